"""German tooltips: what the interface says where the mouse rests, by the English sentence."""

__all__ = ["TOOLTIPS"]

TOOLTIPS = {
    "What it is, in short": "Was es ist, in Kürze",
    "What it is, and what to do about it": "Was es ist, und was dagegen hilft",
    "Whether it is as it should be": "Ob es ist, wie es sein soll",
    "The seed that it was generated with": "Der Startwert, mit dem er erzeugt wurde",
    "The seed that its legs were generated with": (
        "Der Startwert, mit dem seine Beine erzeugt wurden"
    ),
    "The temperature that it was generated at": "Die Temperatur, bei der er erzeugt wurde",
    "The temperature that its legs were generated at": (
        "Die Temperatur, bei der seine Beine erzeugt wurden"
    ),
    "Whether its noise was the same all along the take": (
        "Ob sein Rauschen den ganzen Take über dasselbe war"
    ),
    "Its seed alone makes it again: no part is of another take or was recorded": (
        "Sein Seed allein macht ihn wieder: Kein Teil ist aus einem anderen Take oder aufgenommen"
    ),
    "The take's first frame": "Der erste Frame des Takes",
    "Keep this take": "Diesen Take behalten",
    "Show this take as a stick figure next to the one that plays": (
        "Diesen Take als Strichfigur neben dem zeigen, der abgespielt wird"
    ),
    "How likely the model finds its poses, in nats per frame; higher is more typical": (
        "Wie wahrscheinlich das Modell seine Posen findet, in Nat je Frame; höher ist typischer"
    ),
    (
        "How far a foot slides over the floor at most, in centimetres; landing and rolling "
        "off do not count. From 2 on it is seen"
    ): (
        "Wie weit ein Fuß höchstens über den Boden rutscht, in Zentimetern; Aufsetzen und "
        "Abrollen zählen nicht. Ab 2 sieht man es"
    ),
    "For how many seconds trunk, head, elbows or knees touch furniture": (
        "Wie viele Sekunden Rumpf, Kopf, Ellbogen oder Knie Möbel berühren"
    ),
    "How far head and hands are from their targets on average, in centimetres": (
        "Wie weit Kopf und Hände im Mittel von ihren Zielen entfernt sind, in Zentimetern"
    ),
    "How far a foot slid at most before the clean-up, in centimetres": (
        "Wie weit ein Fuß vor dem Bereinigen höchstens rutschte, in Zentimetern"
    ),
    "For how many seconds the body touched furniture before the clean-up": (
        "Wie viele Sekunden der Körper vor dem Bereinigen Möbel berührte"
    ),
    "How far head and hands were from their targets before the clean-up, in cm": (
        "Wie weit Kopf und Hände vor dem Bereinigen von ihren Zielen entfernt waren, in cm"
    ),
    (
        "Low feet that move per frame, 0 to 2, as papers count them: landing and rolling off "
        "count as well"
    ): (
        "Niedrige Füße, die sich bewegen, je Frame, 0 bis 2, wie Fachartikel sie zählen: "
        "Aufsetzen und Abrollen zählen mit"
    ),
    "Joints that touch furniture, per frame": "Gelenke, die Möbel berühren, je Frame",
    "How jerky the motion is, in m/s³": "Wie ruckhaft die Bewegung ist, in m/s³",
    "What an eye sees of it, the worst first": ("Was ein Auge davon sieht, das Schlimmste zuerst"),
    "Sliding feet per frame before the clean-up": ("Rutschende Füße je Frame vor dem Bereinigen"),
    "Joints that touch furniture, per frame, before the clean-up": (
        "Gelenke, die Möbel berühren, je Frame, vor dem Bereinigen"
    ),
    "How jerky the motion was before the clean-up": (
        "Wie ruckhaft die Bewegung vor dem Bereinigen war"
    ),
    "Walk to a place or up to something, and stand there": (
        "An einen Ort oder zu etwas hingehen und dort stehen"
    ),
    "Walk along a curve to its end": "Eine Kurve bis zu ihrem Ende entlanggehen",
    "Sit down on a seat": "Sich auf einen Sitz setzen",
    "Lie down on a bed or sofa": "Sich auf ein Bett oder Sofa legen",
    "Get up from where one sits or lies": "Aufstehen, wo man sitzt oder liegt",
    "Work at a desk, table or counter": "An einem Schreibtisch, Tisch oder Tresen arbeiten",
    "Write on a board or wall": "An eine Tafel oder Wand schreiben",
    "Reach for something with a hand": "Mit einer Hand nach etwas greifen",
    "Look at something": "Etwas ansehen",
    "Stay as one is": "Bleiben, wie man ist",
    (
        "An object or a collection. Chair.* is any of Chair, Chair.001 …; *board all whose "
        "names end so"
    ): (
        "Ein Objekt oder eine Sammlung. Chair.* ist irgendeines von Chair, Chair.001 …; "
        "*board alle, deren Namen so enden"
    ),
    "A place counts: where to go, or where on a wide seat, top or board": (
        "Ein Ort zählt: wohin es geht, oder wo auf einem breiten Sitz, einer Platte oder Tafel"
    ),
    "In the world": "In der Welt",
    "How long it takes, once one is there": "Wie lange es dauert, wenn man dort ist",
    "Walking speed, in metres per second": "Gehgeschwindigkeit, in Metern je Sekunde",
    "Face something, or in a direction": "Etwas zugewandt sein, oder einer Richtung",
    "0 looks along +Y, counter-clockwise seen from above": (
        "0 blickt entlang +Y, gegen den Uhrzeigersinn von oben gesehen"
    ),
    "What is faced; leave it empty to give a direction": (
        "Wem man zugewandt ist; für eine Richtung leer lassen"
    ),
    "The nearest one that is free and can be reached": ("Das nächste, das frei und erreichbar ist"),
    "Any, by the character's seed": "Irgendeines, nach dem Startwert der Figur",
    "Both hands type": "Beide Hände tippen",
    "One hand writes, the other lies beside": "Eine Hand schreibt, die andere liegt daneben",
    "Both hands handle things": "Beide Hände hantieren",
    "The nearer one to reach, the right one to write": (
        "Die nähere zum Greifen, die rechte zum Schreiben"
    ),
    "The left one": "Die linke",
    "The right one": "Die rechte",
    "The seat, the curve or the moving object that the walk was made for": (
        "Der Sitz, die Kurve oder das bewegte Objekt, wofür der Gang gemacht wurde"
    ),
    "Where the walk ends, in the world": "Wo der Gang endet, in der Welt",
    "Walking speed, in metres per second for a body of 1.75 m": (
        "Gehgeschwindigkeit, in Metern je Sekunde für einen Körper von 1,75 m"
    ),
    "How long it stays where the walk ends, in seconds": (
        "Wie lange sie bleibt, wo der Gang endet, in Sekunden"
    ),
    "Seconds that most of the way down onto the seat takes": (
        "Sekunden, die der größte Teil des Wegs hinab auf den Sitz dauert"
    ),
    "Seconds that most of the way up takes, where the walk begins on a seat": (
        "Sekunden, die der größte Teil des Aufstehens dauert, wo der Gang auf einem Sitz beginnt"
    ),
    "What drives the upper body. Keyframe it to change it during the shot": (
        "Was den Oberkörper führt. Mit Keyframes ändert es sich während der Einstellung"
    ),
    "Only the root is given; the whole body follows from it": (
        "Nur die Wurzel ist gegeben; der ganze Körper folgt daraus"
    ),
    (
        "End effectors: the head, hands and feet reach for their targets. Any of them may be "
        "left empty"
    ): ("Endeffektoren: Kopf, Hände und Füße greifen nach ihren Zielen. Jedes darf leer bleiben"),
    "The whole upper body is copied from another armature; only the legs are generated": (
        "Der ganze Oberkörper wird von einer anderen Armatur übernommen; nur die Beine werden"
        " erzeugt"
    ),
    (
        "Collection of everything the character may touch or must avoid. Leave it empty for a"
        " bare floor"
    ): (
        "Sammlung all dessen, was die Figur berühren darf oder meiden muss. Für einen leeren "
        "Boden leer lassen"
    ),
    "Animated object on the ground under the pelvis: X right, Y forward, Z up": (
        "Animiertes Objekt auf dem Boden unter dem Becken: X rechts, Y vorn, Z oben"
    ),
    (
        "Target of the head joint. Once it is rotated, it turns the head as well: Y is where "
        "the face looks, Z points to the crown"
    ): (
        "Ziel des Kopfgelenks. Ist es gedreht, so dreht es auch den Kopf: Y ist, wohin das "
        "Gesicht blickt, Z zeigt zum Scheitel"
    ),
    (
        "Target of the left wrist. Once it is rotated, it turns the hand as well: Y points "
        "along the fingers, Z out of the back of the hand"
    ): (
        "Ziel des linken Handgelenks. Ist es gedreht, so dreht es auch die Hand: Y zeigt "
        "entlang der Finger, Z aus dem Handrücken"
    ),
    (
        "Target of the right wrist. Once it is rotated, it turns the hand as well: Y points "
        "along the fingers, Z out of the back of the hand"
    ): (
        "Ziel des rechten Handgelenks. Ist es gedreht, so dreht es auch die Hand: Y zeigt "
        "entlang der Finger, Z aus dem Handrücken"
    ),
    (
        "Target of the left ankle, in the modes EE and FULL. Once it is rotated, it turns the"
        " foot as well: Y points along the toes, Z out of the back of the foot"
    ): (
        "Ziel des linken Knöchels, in den Modi EE und FULL. Ist es gedreht, so dreht es auch "
        "den Fuß: Y zeigt entlang der Zehen, Z aus dem Fußrücken"
    ),
    (
        "Target of the right ankle, in the modes EE and FULL. Once it is rotated, it turns "
        "the foot as well: Y points along the toes, Z out of the back of the foot"
    ): (
        "Ziel des rechten Knöchels, in den Modi EE und FULL. Ist es gedreht, so dreht es auch"
        " den Fuß: Y zeigt entlang der Zehen, Z aus dem Fußrücken"
    ),
    (
        "Armature whose upper body is copied: another character, or any rig whose bones are "
        "mapped (see Your Rig)"
    ): (
        "Armatur, deren Oberkörper übernommen wird: eine andere Figur, oder ein Rig, dessen "
        "Knochen zugeordnet sind (siehe Dein Rig)"
    ),
    "Take whose upper body is copied when no source armature is chosen": (
        "Take, dessen Oberkörper übernommen wird, wenn keine Armatur als Quelle gewählt ist"
    ),
    "Frames by which the source plays later here than in the scene": (
        "Frames, um die die Quelle hier später spielt als in der Szene"
    ),
    "Play the source's action over and over, from its first frame to its last": (
        "Die Aktion der Quelle immer wieder abspielen, vom ersten Frame bis zum letzten"
    ),
    "Generate the frames from the scene's start to its end": (
        "Die Frames vom Anfang der Szene bis zu ihrem Ende erzeugen"
    ),
    "First frame to generate": "Erster Frame, der erzeugt wird",
    "Last frame to generate": "Letzter Frame, der erzeugt wird",
    "Another number gives another take, if the temperature is above zero": (
        "Eine andere Zahl gibt einen anderen Take, wenn die Temperatur über null ist"
    ),
    (
        "How many takes to generate at once. Each further take uses the next seed, and "
        "temperature 1 if the temperature is 0"
    ): (
        "Wie viele Takes auf einmal erzeugt werden. Jeder weitere nimmt den nächsten "
        "Startwert, und Temperatur 1, wenn die Temperatur 0 ist"
    ),
    "Takes of this character": "Takes dieser Figur",
    "The take that the buttons below act on": "Der Take, für den die Knöpfe darunter gelten",
    "What this character is to do, in this order": (
        "Was diese Figur tun soll, in dieser Reihenfolge"
    ),
    "The task that the buttons below act on": ("Die Aufgabe, für die die Knöpfe darunter gelten"),
    (
        "At first the character is where its first task is done, seated for example, instead "
        "of where its root stands"
    ): (
        "Zuerst ist die Figur dort, wo ihre erste Aufgabe getan wird, etwa sitzend, statt "
        "dort, wo ihre Wurzel steht"
    ),
    "The walks that the root was keyed for, in the order of time": (
        "Die Gänge, für die die Wurzel Keys hat, in zeitlicher Folge"
    ),
    "The walk that is made again, with those after it": (
        "Der Gang, der neu gemacht wird, mit denen danach"
    ),
    "Number of frames over which the body blends into the new mode": (
        "Zahl der Frames, in denen der Körper in den neuen Modus übergeht"
    ),
    (
        "How much the head's target counts; at 0 the head is free. Keyframe it to reach for a"
        " target and to let go of it"
    ): (
        "Wie sehr das Ziel des Kopfes zählt; bei 0 ist der Kopf frei. Mit Keyframes nach "
        "einem Ziel greifen und es loslassen"
    ),
    "What of the head's target counts. Keyframe it to change it during the shot": (
        "Was vom Ziel des Kopfes zählt. Mit Keyframes ändert es sich während der Einstellung"
    ),
    "Its place, and its rotation once it is rotated": (
        "Sein Ort, und seine Drehung, wenn es gedreht ist"
    ),
    "Only its place; the head turns as it likes": (
        "Nur sein Ort; der Kopf dreht sich, wie er will"
    ),
    "Only its rotation; the head stays where the body brings it": (
        "Nur seine Drehung; der Kopf bleibt, wohin der Körper ihn bringt"
    ),
    (
        "How much the left hand's target counts; at 0 the hand is free. Keyframe it to reach "
        "for the target and to let go of it"
    ): (
        "Wie sehr das Ziel der linken Hand zählt; bei 0 ist die Hand frei. Mit Keyframes nach"
        " dem Ziel greifen und es loslassen"
    ),
    (
        "How much the right hand's target counts; at 0 the hand is free. Keyframe it to reach"
        " for the target and to let go of it"
    ): (
        "Wie sehr das Ziel der rechten Hand zählt; bei 0 ist die Hand frei. Mit Keyframes "
        "nach dem Ziel greifen und es loslassen"
    ),
    (
        "How much the left foot's target counts; at 0 the foot is free. Keyframe it to step "
        "onto the target and to let go of it"
    ): (
        "Wie sehr das Ziel des linken Fußes zählt; bei 0 ist der Fuß frei. Mit Keyframes auf "
        "das Ziel treten und es verlassen"
    ),
    (
        "How much the right foot's target counts; at 0 the foot is free. Keyframe it to step "
        "onto the target and to let go of it"
    ): (
        "Wie sehr das Ziel des rechten Fußes zählt; bei 0 ist der Fuß frei. Mit Keyframes auf"
        " das Ziel treten und es verlassen"
    ),
    (
        "How much takes differ: 0 always gives the same calm take, 1 gives as much variety as"
        " real motion has, above 2 they become strange"
    ): (
        "Wie sehr Takes sich unterscheiden: 0 gibt immer denselben ruhigen, 1 so viel "
        "Vielfalt wie echte Bewegung, über 2 werden sie seltsam"
    ),
    "What makes takes differ, where the temperature is above zero": (
        "Was Takes unterscheidet, wo die Temperatur über null ist"
    ),
    (
        "It varies during the take, as in real motion, so that a body at rest looks alive. "
        "Weights that have not learnt this hold it"
    ): (
        "Es wechselt während des Takes, wie in echter Bewegung, sodass ein ruhender Körper "
        "lebendig wirkt. Gewichte, die das nicht gelernt haben, halten es"
    ),
    "It is the same all along the take, so that a body at rest is calm": (
        "Es ist den ganzen Take über dasselbe, sodass ein ruhender Körper ruhig ist"
    ),
    "Guess how soft this piece of furniture is from its name and shape": (
        "Aus Name und Form schätzen, wie weich dieses Möbel ist"
    ),
    (
        "Centimetres by which this piece of furniture gives way under a body, compared with a"
        " hard bench: 3 for wooden chairs, 7 for office and arm chairs, 11 for sofas and beds"
    ): (
        "Zentimeter, um die dieses Möbel unter einem Körper nachgibt, verglichen mit einer "
        "harten Bank: 3 für Holzstühle, 7 für Büro- und Armstühle, 11 für Sofas und Betten"
    ),
    (
        "How firmly a standing foot is held in place, so that it does not slide; 0 leaves the"
        " raw motion"
    ): (
        "Wie fest ein stehender Fuß gehalten wird, damit er nicht rutscht; 0 lässt die rohe "
        "Bewegung"
    ),
    (
        "How far a body that sinks into a seat, or hovers over it, is brought to where the "
        "seat carries it; 0 leaves the raw motion"
    ): (
        "Wie weit ein Körper, der in einen Sitz einsinkt oder darüber schwebt, dorthin "
        "gebracht wird, wo der Sitz ihn trägt; 0 lässt die rohe Bewegung"
    ),
    (
        "How exactly the head, hands and feet are brought onto their targets, as far as limbs"
        " and back allow; 0 leaves the raw motion"
    ): (
        "Wie genau Kopf, Hände und Füße auf ihre Ziele gebracht werden, soweit Glieder und "
        "Rücken es erlauben; 0 lässt die rohe Bewegung"
    ),
    (
        "How far hands and feet that are inside furniture are moved out of it; 0 leaves the "
        "raw motion"
    ): (
        "Wie weit Hände und Füße, die in Möbeln stecken, herausbewegt werden; 0 lässt die "
        "rohe Bewegung"
    ),
    (
        "How much abrupt changes of the motion are smoothed out, before feet and hands are "
        "put in place; 0 leaves the raw motion"
    ): (
        "Wie sehr plötzliche Änderungen der Bewegung geglättet werden, ehe Füße und Hände an "
        "ihren Platz kommen; 0 lässt die rohe Bewegung"
    ),
    "Bone of this joint; leave it empty where the rig has none": (
        "Knochen dieses Gelenks; leer lassen, wo das Rig keinen hat"
    ),
    "Bones of the joints": "Knochen der Gelenke",
    "The row that is selected": "Die gewählte Zeile",
    "Name of the preset that the bones come from": ("Name der Vorgabe, von der die Knochen sind"),
    "Bone that carries the whole rig": "Knochen, der das ganze Rig trägt",
    "DAFNet character whose motion is baked onto this armature": (
        "DAFNet-Figur, deren Bewegung auf diese Armatur gebacken wird"
    ),
    "What carries the character through the scene": "Was die Figur durch die Szene trägt",
    "The armature object moves over the floor and turns with the character": (
        "Das Armatur-Objekt bewegt sich über den Boden und dreht sich mit der Figur"
    ),
    "The root bone moves over the floor and turns with the character": (
        "Der Wurzelknochen bewegt sich über den Boden und dreht sich mit der Figur"
    ),
    "Only the hips move; object and root bone stay": (
        "Nur die Hüfte bewegt sich; Objekt und Wurzelknochen bleiben"
    ),
    "Which controls of arms and legs are keyed": (
        "Welche Steuerungen von Armen und Beinen Keys bekommen"
    ),
    "Rotate each bone of the arms and legs": "Jeden Knochen der Arme und Beine drehen",
    ("Place the hand, foot and pole controls; for rigs whose preset knows them, such as Rigify"): (
        "Die Steuerungen von Händen, Füßen und Polen setzen; für Rigs, deren Vorgabe sie "
        "kennt, wie Rigify"
    ),
    ("Add a character at the 3D cursor: an armature with a body, and the empties that direct it"): (
        "Eine Figur am 3D-Cursor hinzufügen: eine Armatur mit Körper, und die Empties, die "
        "sie lenken"
    ),
    "Name of the character and of its collection": "Name der Figur und ihrer Sammlung",
    "Crown to sole, in metres": "Scheitel bis Sohle, in Metern",
    "How stout the body is; the motion is the same": (
        "Wie kräftig der Körper ist; die Bewegung ist dieselbe"
    ),
    (
        "Generate the motion of the selected characters from their roots, targets and "
        "furniture, and bake it into new actions"
    ): (
        "Die Bewegung der gewählten Figuren aus ihren Wurzeln, Zielen und Möbeln erzeugen und"
        " in neue Aktionen backen"
    ),
    "Generate new takes": "Neue Takes erzeugen",
    "Generate other legs under the upper body of the chosen take": (
        "Andere Beine unter dem Oberkörper des gewählten Takes erzeugen"
    ),
    "Keep the chosen take up to the current frame, and generate the rest anew": (
        "Den gewählten Take bis zum aktuellen Frame behalten und den Rest neu erzeugen"
    ),
    "Stop the job that is running; the scene stays as it was": (
        "Die laufende Arbeit anhalten; die Szene bleibt, wie sie war"
    ),
    (
        "Continue the root's keys from the last one: the character walks around the furniture"
        " and sits down, or stops at the 3D cursor"
    ): (
        "Die Keys der Wurzel vom letzten an fortsetzen: die Figur geht um die Möbel herum und"
        " setzt sich, oder hält am 3D-Cursor"
    ),
    (
        "Walk to the selected piece of furniture and sit down on it; the 3D cursor, if it is "
        "on it, says where and to which side"
    ): (
        "Zum gewählten Möbel gehen und sich setzen; der 3D-Cursor, wenn er darauf ist, sagt, "
        "wo und nach welcher Seite"
    ),
    "Walk to the 3D cursor and stand there": "Zum 3D-Cursor gehen und dort stehen",
    "Sit on a table or a desk as well, if that is selected": (
        "Sich auch auf einen Tisch oder Schreibtisch setzen, wenn der gewählt ist"
    ),
    "A seat that is tucked under a table, so that the character fits": (
        "Ein Sitz, der unter einem Tisch steht, damit die Figur Platz hat"
    ),
    "Say by how far it has to come out, and do nothing": (
        "Sagen, wie weit er hervor muss, und nichts tun"
    ),
    "Move it out": "Ihn hervorziehen",
    "Key its location: it comes out before the character is near": (
        "Seine Position mit Keys versehen: er kommt hervor, ehe die Figur nahe ist"
    ),
    (
        "Keep where one sits on the piece, as the custom property OMI_seat, which glTF files "
        "take along; it counts the next time"
    ): (
        "Am Möbel merken, wo man sitzt, als eigene Eigenschaft OMI_seat, die glTF-Dateien "
        "mitnehmen; das nächste Mal zählt sie"
    ),
    (
        "Walk to the selected bed or sofa, sit down on its edge and lie down: root, targets "
        "and modes are keyed from the start of the range on. Keys that you have edited are "
        "kept in an action of their own"
    ): (
        "Zum gewählten Bett oder Sofa gehen, sich auf die Kante setzen und hinlegen: Wurzel, "
        "Ziele und Modi bekommen Keys vom Anfang des Bereichs an. Keys, die du bearbeitet "
        "hast, bleiben in einer eigenen Aktion"
    ),
    (
        "How far the trunk leans back while the character sits, more than by itself; forward below "
        "0. Hands that hold on to something stay there, and a chair's back is where it ends"
    ): (
        "Wie weit sich der Rumpf im Sitzen zurücklehnt, mehr als von selbst; nach vorn unter 0. "
        "Hände, die sich an etwas halten, bleiben dort, und an der Lehne eines Stuhls endet es"
    ),
    (
        "Make the chosen walk anew, and those after it: to where its seat is now, from where "
        "you have moved the character to, with the speed and seconds above. Keys that you "
        "have edited are asked about"
    ): (
        "Den gewählten Gang neu machen, und die danach: dorthin, wo sein Sitz jetzt ist, von "
        "dort, wohin du die Figur bewegt hast, mit Geschwindigkeit und Sekunden darüber. Bei "
        "Keys, die du bearbeitet hast, wird gefragt"
    ),
    "Replace keys that you have edited as well; a copy of their action is kept": (
        "Auch Keys ersetzen, die du bearbeitet hast; eine Kopie ihrer Aktion bleibt"
    ),
    "Add a task after the chosen one": "Eine Aufgabe nach der gewählten hinzufügen",
    "Remove the chosen task": "Die gewählte Aufgabe entfernen",
    "Let the chosen task be done earlier or later": ("Die gewählte Aufgabe früher oder später tun"),
    "Before the one above": "Vor der darüber",
    "After the one below": "Nach der darunter",
    (
        "Plan the tasks of the selected characters, round each other and all others, and key "
        "roots, targets, influences and modes. Keys that you have edited are kept in an "
        "action of their own"
    ): (
        "Die Aufgaben der gewählten Figuren planen, umeinander und um alle anderen herum, und"
        " Wurzeln, Ziele, Einflüsse und Modi mit Keys versehen. Keys, die du bearbeitet hast,"
        " bleiben in einer eigenen Aktion"
    ),
    "Let the character play this take": "Die Figur diesen Take spielen lassen",
    "The take of the row": "Der Take der Zeile",
    "The take below the one that plays": "Der Take unter dem, der abgespielt wird",
    "The take above the one that plays": "Der Take über dem, der abgespielt wird",
    (
        "Remove the chosen take from the list; its action is deleted when the file is saved "
        "and reopened, unless something uses it"
    ): (
        "Den gewählten Take aus der Liste entfernen; seine Aktion wird gelöscht, wenn die "
        "Datei gespeichert und wieder geöffnet wird, falls nichts sie benutzt"
    ),
    "Reject every take that is not accepted": "Jeden Take verwerfen, der nicht angenommen ist",
    ("Clean up the chosen take with the present settings, as a new take; nothing is generated"): (
        "Den gewählten Take mit den jetzigen Einstellungen bereinigen, als neuen Take; nichts"
        " wird erzeugt"
    ),
    (
        "Show in the timeline where feet slide (yellow) and joints touch furniture (red) in "
        "the take that plays, or hide it"
    ): (
        "In der Zeitleiste zeigen, wo im abgespielten Take Füße rutschen (gelb) und Gelenke "
        "Möbel berühren (rot), oder es verbergen"
    ),
    "Add a preset of temperature, number of takes and clean-up, or remove the chosen one": (
        "Eine Vorgabe aus Temperatur, Zahl der Takes und Bereinigen hinzufügen, oder die "
        "gewählte entfernen"
    ),
    (
        "Write versions, the character's settings, and the figures and warnings of the take "
        "that plays into a text of this file and onto the clipboard, to add them to a "
        "question or an issue. It holds no names and no paths"
    ): (
        "Versionen, Einstellungen der Figur, und Zahlen und Warnungen des abgespielten Takes "
        "in einen Text dieser Datei und in die Zwischenablage schreiben, um sie einer Frage "
        "oder Meldung beizufügen. Namen und Pfade stehen nicht darin"
    ),
    (
        "Key the character's root along the selected curve from the current frame on; later "
        "keys are replaced"
    ): (
        "Die Wurzel der Figur vom aktuellen Frame an entlang der gewählten Kurve mit Keys "
        "versehen; spätere Keys werden ersetzt"
    ),
    "Keep looking where it looks now, instead of along the curve": (
        "Weiter blicken, wohin sie jetzt blickt, statt entlang der Kurve"
    ),
    "Walk from the curve's end to its beginning": "Vom Ende der Kurve zu ihrem Anfang gehen",
    (
        "Continue the root's keys through the selected empties, in the order of their names, "
        "or to the 3D cursor if none is selected"
    ): (
        "Die Keys der Wurzel durch die gewählten Empties fortsetzen, in der Folge ihrer "
        "Namen, oder zum 3D-Cursor, wenn keines gewählt ist"
    ),
    "Walk on from the last empty to the 3D cursor": (
        "Vom letzten Empty weiter zum 3D-Cursor gehen"
    ),
    (
        "Key the root along the path of the selected moving object, in the same frames; later"
        " keys are replaced"
    ): (
        "Die Wurzel entlang des Wegs des gewählten bewegten Objekts mit Keys versehen, in "
        "denselben Frames; spätere Keys werden ersetzt"
    ),
    (
        "Link the visible meshes within 1.5 m of the root's path into a collection of the "
        "character's own, as its furniture"
    ): (
        "Die sichtbaren Meshes im Umkreis von 1,5 m um den Weg der Wurzel in eine eigene "
        "Sammlung der Figur verknüpfen, als ihre Möbel"
    ),
    "Add the empty that leads the character, where it stands now": (
        "Das Empty hinzufügen, das die Figur führt, wo sie jetzt steht"
    ),
    (
        "Add the missing targets of the feet, where these are now; in the modes EE and FULL "
        "the character steps onto them"
    ): (
        "Die fehlenden Ziele der Füße hinzufügen, wo diese jetzt sind; in den Modi EE und "
        "FULL tritt die Figur darauf"
    ),
    (
        "Add the missing targets of head and hands, where these are now; in mode EE the "
        "character follows them"
    ): (
        "Die fehlenden Ziele von Kopf und Händen hinzufügen, wo diese jetzt sind; im Modus EE"
        " folgt ihnen die Figur"
    ),
    ("Add furniture at the 3D cursor and a character that uses it, keyed and ready to generate"): (
        "Möbel am 3D-Cursor und eine Figur hinzufügen, die sie benutzt, mit Keys und bereit "
        "zum Erzeugen"
    ),
    "Walks up to a desk, sits down and writes": (
        "Geht an einen Schreibtisch, setzt sich und schreibt"
    ),
    "Walks up to a whiteboard, writes on it and steps aside": (
        "Geht an eine Tafel, schreibt darauf und tritt zur Seite"
    ),
    "Walks up to a sofa, sits down, gets up and walks off": (
        "Geht zu einem Sofa, setzt sich, steht auf und geht weg"
    ),
    "Sits down on a bed and lies down on it": "Setzt sich auf ein Bett und legt sich hin",
    "Find the bone of each joint by its name": ("Den Knochen jedes Gelenks an seinem Namen finden"),
    "Load the bones from a preset": "Die Knochen aus einer Vorgabe laden",
    "Save the bones of the list as a preset of your own": (
        "Die Knochen der Liste als eigene Vorgabe speichern"
    ),
    (
        "Scale the character until its legs are as long as those of this armature, so that "
        "what you generate next has its stride, and hands, seats and feet stay where they are"
    ): (
        "Die Figur skalieren, bis ihre Beine so lang sind wie die dieser Armatur, sodass, was"
        " du danach erzeugst, deren Schritt hat, und Hände, Sitze und Füße bleiben, wo sie "
        "sind"
    ),
    (
        "Bake the motion that the character plays, your edits included, into a new action on "
        "this armature"
    ): (
        "Die Bewegung, die die Figur spielt, samt deinen Bearbeitungen, in eine neue Aktion "
        "auf dieser Armatur backen"
    ),
    (
        "Let the character follow while you drag its root and its targets; again, or Esc, "
        "puts everything back, but for what was recorded"
    ): (
        "Die Figur folgen lassen, während du ihre Wurzel und ihre Ziele ziehst; noch einmal, "
        "oder Esc, stellt alles zurück, außer was aufgenommen wurde"
    ),
    (
        "Draw a way on the floor with the left mouse button, which the root is led along; "
        "again to drag and select as ever"
    ): (
        "Mit der linken Maustaste einen Weg auf den Boden zeichnen, den die Wurzel "
        "entlanggeführt wird; noch einmal, um wie sonst zu ziehen und zu wählen"
    ),
    ("Keep what is played from now on as a take; again to stop. Takes are made when Live ends"): (
        "Was von jetzt an gespielt wird, als Take behalten; noch einmal hält an. Takes "
        "entstehen, wenn Live endet"
    ),
    ("The spheres around the root that furniture occupies now: all that the network sees of it"): (
        "Die Kugeln um die Wurzel, die Möbel jetzt belegen: alles, was das Netz davon sieht"
    ),
    "The root's path on the floor and where it faces": (
        "Der Weg der Wurzel auf dem Boden und wohin sie blickt"
    ),
    "Planted feet (green), joints that touch furniture (orange) or are inside it (red)": (
        "Stehende Füße (grün), Gelenke, die Möbel berühren (orange) oder darin sind (rot)"
    ),
    "How likely each of the network's actions is, as the rays of a circle": (
        "Wie wahrscheinlich jede der Handlungen des Netzes ist, als Strahlen eines Kreises"
    ),
    "The paths of the head and hands, and their targets (red)": (
        "Die Wege von Kopf und Händen und ihre Ziele (rot)"
    ),
    "The takes whose ghost is ticked in the list, as stick figures": (
        "Die Takes, deren Geist in der Liste angekreuzt ist, als Strichfiguren"
    ),
    "File of trained weights. Leave it empty for the weights that come with the add-on": (
        "Datei mit trainierten Gewichten. Leer lassen für die, die mit dem Add-on kommen"
    ),
    "furniture at the 3D cursor and a character, ready to generate": (
        "Möbel am 3D-Cursor und eine Figur, bereit zum Erzeugen"
    ),
    "A .glb for engines and the web": ("Ein .glb für Engines und das Web"),
    "A .usdc for pipelines": ("Ein .usdc für Pipelines"),
    "A bone over the hips moves through the room": (
        "Ein Knochen über der Hüfte bewegt sich durch den Raum"
    ),
    (
        "Armature whose legs are copied, in the mode FULL: another character, or any rig whose "
        "bones are mapped. Leave it empty to have them generated"
    ): (
        "Armatur, deren Beine im Modus FULL kopiert werden: eine andere Figur oder irgendein Rig,"
        " dessen Knochen zugeordnet sind. Leer lassen, damit sie erzeugt werden"
    ),
    "Bones alone, for motion tools": ("Nur Knochen, für Bewegungsprogramme"),
    "For Unreal, Unity, Maya, MotionBuilder": ("Für Unreal, Unity, Maya, MotionBuilder"),
    "Generate the frames of the preview range anew, and keep the chosen take before and after it": (
        "Die Bilder des Vorschaubereichs neu erzeugen und den gewählten Take davor und danach "
        "behalten"
    ),
    (
        "How much what is looked at counts; at 0 the head turns as it likes. Keyframe it to look "
        "at something and away again"
    ): (
        "Wie sehr zählt, was angesehen wird; bei 0 dreht sich der Kopf, wie er will. Mit "
        "Keyframes sieht die Figur etwas an und wieder weg"
    ),
    "Mark the chosen take as an asset, with tags and a picture; its catalog stays as it is": (
        "Den gewählten Take als Asset markieren, mit Schlagwörtern und einem Bild; sein Katalog "
        "bleibt, wie er ist"
    ),
    "Put the chosen take as a strip onto a track of its own in the Nonlinear Animation editor": (
        "Den gewählten Take als Strip auf eine eigene Spur im Editor für nichtlineare Animation "
        "legen"
    ),
    "Replace files that are there already": ("Dateien ersetzen, die schon da sind"),
    (
        "The character stands at the root before the first frame; over a seat it has sat down there"
    ): ("Die Figur steht vor dem ersten Bild an der Wurzel; auf einem Sitz hat sie sich gesetzt"),
    "The hips move through the room": ("Die Hüfte bewegt sich durch den Raum"),
    "What takes begin with": ("Womit Takes beginnen"),
    (
        "What the character looks at, in any mode: an empty, a piece of furniture, somebody. The "
        "head turns to it, and the chest where that is not enough, as far and as fast as people "
        "do; the body stays where it is"
    ): (
        "Was die Figur ansieht, in jedem Modus: ein Empty, ein Möbel, jemanden. Der Kopf wendet "
        "sich hin, und die Brust, wo das nicht genügt, so weit und so schnell, wie Menschen es "
        "tun; der Körper bleibt, wo er ist"
    ),
    (
        "With the pose and the motion that the character has in the first frame and before it: go"
        " on from another take, from an animation, or from a pose"
    ): (
        "Mit der Pose und der Bewegung, die die Figur im ersten Bild und davor hat: weiter nach "
        "einem anderen Take, einer Animation oder aus einer Pose"
    ),
    (
        "Write the chosen take of each selected character into a file for other programs: her "
        "bones and meshes, one action, and the way through the room on a root bone or the hips"
    ): (
        "Den gewählten Take jeder gewählten Figur in eine Datei für andere Programme schreiben: "
        "ihre Knochen und Netze, eine Action, und den Weg durch den Raum auf einem Wurzelknochen "
        "oder der Hüfte"
    ),
}
