// A small stand-in of what Flamenco's Manager gives a job type: compiles a job of the settings in
// the second argument and prints its tasks as JSON.
"use strict";

const { readFileSync } = require("fs");
const { runInNewContext } = require("vm");

const tasks = [];

class Task {
    constructor(name, type) {
        Object.assign(this, { name, type, commands: [], dependsOn: [] });
    }
    addCommand(command) {
        this.commands.push(command);
    }
    addDependency(task) {
        if (!(task instanceof Task)) throw new TypeError("a task depends on tasks alone");
        this.dependsOn.push(task.name);
    }
}

const author = {
    Task: (name, type) => new Task(name, type),
    Command: (name, parameters) => ({ name, parameters }),
};

const [, , file, given] = process.argv;
const context = { author };
runInNewContext(`${readFileSync(file, "utf8")}\nthis.type = JOB_TYPE; this.compile = compileJob;`, context);

const settings = {};
for (const setting of context.type.settings) {
    if (setting.default !== undefined) settings[setting.key] = setting.default;
}
Object.assign(settings, JSON.parse(given));
for (const setting of context.type.settings) {
    if (setting.required && settings[setting.key] === undefined) throw new Error(`${setting.key} is missing`);
}

context.compile({ settings, addTask: task => tasks.push(task) });
console.log(JSON.stringify({ type: context.type, tasks }));
