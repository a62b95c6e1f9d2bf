"""The add-on's words in other languages; Blender shows them where its interface is translated. A
language is one table here.
"""

import bpy

__all__ = ["register", "unregister"]

_GERMAN = {
    "Add Character": "Figur hinzufügen",
    "Add Root": "Wurzel hinzufügen",
    "Add DAFNet Example": "DAFNet-Beispiel hinzufügen",
    "Add Preset": "Vorgabe hinzufügen",
    "Add Targets": "Ziele hinzufügen",
    "Accepted": "Angenommen",
    "Backwards": "Rückwärts",
    "Bake to Rig": "Auf Rig backen",
    "Blend": "Überblenden",
    "Bone": "Knochen",
    "Build": "Statur",
    "Cancel": "Abbrechen",
    "Character": "Figur",
    "Clean Up Again": "Neu bereinigen",
    "Clean-Up": "Bereinigen",
    "Clear Furniture": "Aus Möbeln lösen",
    "Collisions": "Berührungen",
    "Contacts": "Kontakte",
    "DAFNet Presets": "DAFNet-Vorgaben",
    "Deleted": "Gelöscht",
    "Detect Bones": "Knochen erkennen",
    "Engine": "Rechenwerk",
    "Example": "Beispiel",
    "Find Furniture": "Möbel finden",
    "From Here On": "Von hier an",
    "Furniture": "Möbel",
    "Generate": "Erzeugen",
    "Generated takes are listed here": "Erzeugte Takes stehen hier",
    "Ghost": "Geist",
    "Ghosts": "Geister",
    "Head and Hands": "Kopf und Hände",
    "Head Influence": "Einfluss Kopf",
    "Hips": "Hüfte",
    "Influence": "Einfluss",
    "Jerk": "Ruck",
    "Jerk, m/s³": "Ruck, m/s³",
    "Joint": "Gelenk",
    "Keep Accepted Only": "Nur Angenommene behalten",
    "Keep Facing": "Blickrichtung halten",
    "Left Hand": "Linke Hand",
    "Left Hand Influence": "Einfluss linke Hand",
    "Legs' Seed": "Startwert der Beine",
    "Legs' Temperature": "Temperatur der Beine",
    "Likelihood": "Wahrscheinlichkeit",
    "Limbs": "Gliedmaßen",
    "Load Rig Preset": "Rig-Vorgabe laden",
    "Mark Frames": "Frames markieren",
    "Miss": "Abstand vom Ziel",
    "Miss, cm": "Abstand, cm",
    "Mode": "Modus",
    "No character is selected": "Keine Figur ist gewählt",
    "On to Cursor": "Weiter zum Cursor",
    "Open the Guide": "Anleitung öffnen",
    "Overlays": "Einblendungen",
    "Plant Feet": "Füße festhalten",
    "Play Take": "Take abspielen",
    "PyTorch on a GPU (CUDA)": "PyTorch auf einer GPU (CUDA)",
    "PyTorch on a GPU (Metal)": "PyTorch auf einer GPU (Metal)",
    "PyTorch on the CPU": "PyTorch auf der CPU",
    "Reach Targets": "Ziele erreichen",
    "Reject Take": "Take verwerfen",
    "Rest on Seats": "Auf Sitzen ruhen",
    "Right Hand": "Rechte Hand",
    "Right Hand Influence": "Einfluss rechte Hand",
    "Root": "Wurzel",
    "Root Bone": "Wurzelknochen",
    "Root from Object": "Wurzel aus Objekt",
    "Root Motion": "Bewegung der Wurzel",
    "Root Path": "Weg der Wurzel",
    "Save Rig Preset": "Rig-Vorgabe speichern",
    "Scene Range": "Bereich der Szene",
    "Seed": "Startwert",
    "Set Up": "Einrichten",
    "Sit on Selected": "Auf Gewähltes setzen",
    "Sliding": "Rutschen",
    "Sliding feet": "Rutschende Füße",
    "Smooth": "Glätten",
    "Source": "Quelle",
    "Stay": "Verweilen",
    "Take": "Take",
    "Takes": "Takes",
    "Temperature": "Temperatur",
    "To": "Ziel",
    "Vary the Legs": "Beine variieren",
    "Walk along Curve": "Kurve entlanggehen",
    "Walk through Points": "Durch Punkte gehen",
    "Walk To": "Gehen zu",
    "Walk to Cursor": "Zum Cursor gehen",
    "Weights": "Gewichte",
    "Your Rig": "Dein Rig",
}


def register() -> None:
    """Give Blender the tables."""
    table = {
        (context, word): said for word, said in _GERMAN.items() for context in ("*", "Operator")
    }
    bpy.app.translations.register(__package__, {"de_DE": table})


def unregister() -> None:
    """Remove the tables."""
    bpy.app.translations.unregister(__package__)
