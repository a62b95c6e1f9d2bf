// A list of shots for Flamenco: a task for every few shots, and the report when all are done.
"use strict";

const JOB_TYPE = {
    label: "DAFNet Batch",
    description: "Make a list of shots with `dafnet batch`",
    settings: [
        { key: "list", type: "string", subtype: "file_path", required: true, visible: "submission",
          description: "The list of shots (JOBS.toml)" },
        { key: "output", type: "string", subtype: "dir_path", required: true, visible: "submission",
          description: "Where the shots are written; the same for all workers" },
        { key: "shots", type: "int32", required: true, default: 1, visible: "submission",
          description: "How many shots the list has; `dafnet batch LIST -o OUTPUT --report` says it" },
        { key: "chunk_size", type: "int32", default: 1, visible: "submission",
          description: "Shots in one task" },
        { key: "dafnet", type: "string", default: "dafnet", visible: "submission",
          description: "The command on the workers" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    const size = Math.max(1, settings.chunk_size);
    const report = author.Task("report", "misc");
    report.addCommand(run(settings, ["--report"]));

    for (let first = 1; first <= settings.shots; first += size) {
        const last = Math.min(first + size - 1, settings.shots);
        const task = author.Task(`shots-${first}-${last}`, "misc");
        task.addCommand(run(settings, ["--workers", "1", "--only", `${first}:${last}`]));
        job.addTask(task);
        report.addDependency(task);
    }

    job.addTask(report);
}

function run(settings, options) {
    return author.Command("exec", {
        exe: settings.dafnet,
        args: ["batch", settings.list, "-o", settings.output].concat(options),
    });
}
