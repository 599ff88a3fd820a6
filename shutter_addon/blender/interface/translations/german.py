"""German, in the terms of Blender's own: strip "Streifen", keyframe "Schlüsselbild", sequencer "Sequenzer".

Ours: shutter "Verschluss", bar "Balken", region "Region", scribble "Markierung", recipe "Rezept",
matte "Matte" (Blender's "Maske" is a mask), ramp "Verlauf", time map "Zeitkarte", feather "Weiche Kante".
"""

MESSAGES = {
    # Panels, menus, lists
    ("*", "Virtual Shutter"): "Virtual Shutter",
    ("*", "Shutter"): "Verschluss",
    ("*", "Regions"): "Regionen",
    ("*", "Bars"): "Balken",
    ("*", "Shutters"): "Verschlüsse",
    ("*", "Outline"): "Umriss",
    ("*", "Preview"): "Vorschau",
    ("*", "Transform"): "Transformation",
    ("*", "Options"): "Optionen",
    ("*", "Presets"): "Voreinstellungen",
    ("*", "Notes"): "Hinweise",
    ("*", 'Exposure of "{shutter}"'): "Belichtung von „{shutter}“",
    ("*", "Shutter Specials"): "Verschluss-Spezialmenü",
    ("*", "Shutter Bars"): "Verschlussbalken",
    ("*", "Shutter Region"): "Verschlussregion",
    ("*", "Split View"): "Geteilte Ansicht",
    ("Operator", "Shutter"): "Verschluss",
    ("Operator", "Insert Keyframes"): "Schlüsselbilder hinzufügen",
    ("*", "default"): "Standard",
    ("*", "{angle}° ({frames} of {window} frames)"): "{angle}° ({frames} von {window} Bildern)",
    ("*", "Open for {frames} of {window} frames here"): "Hier {frames} von {window} Bildern lang offen",
    ("*", "All bars are zero: the shutter never opens"): "Alle Balken sind null: Der Verschluss öffnet nie",
    # Names of what is new
    ("*", "Shutter {source}"): "Verschluss {source}",
    ("*", "Scribbles {effect}"): "Markierungen {effect}",
    ("*", "Long"): "Lang",
    ("*", "Sharp"): "Scharf",
    ("*", "Region"): "Region",
    # The effect
    ("Operator", "Add Shutter Strip"): "Verschlussstreifen hinzufügen",
    (
        "*",
        "Add a Shutter strip above the active strip, which gives every pixel an exposure of its own",
    ): "Verschlussstreifen über dem aktiven Streifen hinzufügen, der jedem Pixel eine eigene Belichtung gibt",
    ("*", "Scene"): "Szene",
    ("*", "Scene that the effect's strips show"): "Szene, die die Streifen des Effekts zeigen",
    ("*", "Source"): "Quelle",
    ("*", "Identity of the source strip"): "Kennung des Quellstreifens",
    ("*", "Start"): "Start",
    (
        "*",
        "Timeline frame where the effect's content starts",
    ): "Bild der Zeitleiste, bei dem der Inhalt des Effekts beginnt",
    ("*", "Name"): "Name",
    ("*", "Name of the effect"): "Name des Effekts",
    ("*", "Select a Shutter strip or its source strip"): "Einen Verschlussstreifen oder seinen Quellstreifen auswählen",
    ("*", "Move the playhead onto the Shutter strip"): "Den Abspielkopf auf den Verschlussstreifen bewegen",
    ("*", "Unmute the Shutter strip"): "Die Stummschaltung des Verschlussstreifens aufheben",
    (
        "*",
        "Open the meta strip that the Shutter strip is in",
    ): "Den Meta-Streifen öffnen, in dem der Verschlussstreifen liegt",
    ("*", "Select a movie, image or clip strip"): "Einen Film-, Bild- oder Clipstreifen auswählen",
    (
        "*",
        "The active strip is not a movie, image or clip strip",
    ): "Der aktive Streifen ist kein Film-, Bild- oder Clipstreifen",
    ("*", "The edit is linked from another file"): "Der Schnitt ist aus einer anderen Datei verknüpft",
    ("*", '"{effect}" has no shutter'): "„{effect}“ hat keinen Verschluss",
    ("*", 'scene "{scene}" belongs to no Shutter strip'): "Szene „{scene}“ gehört zu keinem Verschlussstreifen",
    ("*", 'the source strip of "{strip}" was deleted'): "der Quellstreifen von „{strip}“ wurde gelöscht",
    (
        "*",
        "the {limit} MB that may be taken of the GPU are too few for {frames} frames of {width}×{height}: all are sent"
        " for every picture, which is slow",
    ): "die {limit} MB, die von der GPU genommen werden dürfen, reichen nicht für {frames} Einzelbilder von"
    " {width}×{height}: für jedes Bild werden alle neu gesendet, und das ist langsam",
    (
        "*",
        "a second Blender decodes movies, which is slow: install the zip that is made for your system",
    ): "ein zweites Blender dekodiert Filme, und das ist langsam: installieren Sie die Zip-Datei für Ihr System",
    (
        "*",
        "View > Render Sequencer Animation cannot use Blender's own GPU, as Render > Render Animation can",
    ): "Ansicht > Sequencer-Animation rendern kann Blenders eigene GPU nicht nutzen, anders als Rendern > Animation"
    " rendern",
    ("*", "Blender's GPU cannot be used until a window is drawn"): "Blenders GPU lässt sich erst nutzen, wenn ein"
    " Fenster gezeichnet wurde",
    ("*", "the effect was deleted while it was rendered"): "der Effekt wurde gelöscht, während er gerendert wurde",
    ("*", 'the scene of "{strip}" was deleted'): "die Szene von „{strip}“ wurde gelöscht",
    ("*", 'the scene of "{strip}" has no camera'): "die Szene von „{strip}“ hat keine Kamera",
    ("*", 'the setting "{setting}" leaves "{strip}" out'): "die Einstellung „{setting}“ lässt „{strip}“ weg",
    (
        "*",
        'the source of "{strip}", "{source}", is not a movie, image or clip strip',
    ): "die Quelle von „{strip}“, „{source}“, ist kein Film-, Bild- oder Clipstreifen",
    ("*", 'effect "{name}"'): "Effekt „{name}“",
    ("*", 'shutter "{name}"'): "Verschluss „{name}“",
    ("*", 'region "{name}"'): "Region „{name}“",
    ("*", "{shutter}, bar {number}"): "{shutter}, Balken {number}",
    (
        "*",
        "{place}: {property} is {value}, not {low} to {high}",
    ): "{place}: {property} ist {value}, nicht {low} bis {high}",
    (
        "*",
        '"{scene}" was saved by a newer version of Virtual Shutter ({version}): what this one does not know '
        "is kept, but not shown",
    ): "„{scene}“ wurde von einer neueren Version von Virtual Shutter gespeichert ({version}): Was diese nicht kennt, "
    "bleibt erhalten, wird aber nicht gezeigt",
    (
        "*",
        '"{scene}" was saved by a newer version of Virtual Shutter ({version}): what this one does not know '
        "is kept, but not shown, and no effect in this file follows strips that you move, copy or delete",
    ): "„{scene}“ wurde von einer neueren Version von Virtual Shutter gespeichert ({version}): Was diese nicht kennt, "
    "bleibt erhalten, wird aber nicht gezeigt, und kein Effekt dieser Datei folgt Streifen, die verschoben, kopiert "
    "oder gelöscht werden",
    (
        "*",
        'Saved "{path}", without what a newer version of Virtual Shutter has added',
    ): "„{path}“ gespeichert, ohne das, was eine neuere Version von Virtual Shutter hinzugefügt hat",
    ("*", "{place}: {property} is none of its choices"): "{place}: {property} ist keine der Möglichkeiten",
    (
        "*",
        "{place}: {property} has a keyframe at frame {frame}, not {low} to {high}",
    ): "{place}: {property} hat ein Schlüsselbild bei Bild {frame}, nicht {low} bis {high}",
    ("*", "{place}: {count} bars, and {window} frames"): "{place}: {count} Balken und {window} Bilder",
    (
        "*",
        "{place}: {count} shutters, {most} are the most",
    ): "{place}: {count} Verschlüsse, höchstens {most} sind möglich",
    (
        "*",
        "{place}: {count} regions, {most} are the most",
    ): "{place}: {count} Regionen, höchstens {most} sind möglich",
    (
        "*",
        "{place}: its name has {count} characters, {most} are the most",
    ): "{place}: der Name hat {count} Zeichen, höchstens {most} sind möglich",
    ("*", "An effect has {most} shutters at most"): "Ein Effekt hat höchstens {most} Verschlüsse",
    ("*", "An effect has {most} regions at most"): "Ein Effekt hat höchstens {most} Regionen",
    (
        "*",
        'shutter "{name}": bars {first} to {last} of the older file are one filmed frame now, and expose other moments',
    ): "Verschluss „{name}“: Balken {first} bis {last} der älteren Datei sind jetzt ein gefilmtes Bild und belichten "
    "andere Momente",
    (
        "*",
        'region "{name}": more than {most} points with those before it',
    ): "Region „{name}“: mehr als {most} Punkte mit denen davor",
    (
        "*",
        'region "{name}": a point of its strokes is nowhere near the picture',
    ): "Region „{name}“: ein Punkt ihrer Striche liegt weit weg vom Bild",
    (
        "*",
        'strip "{strip}": a number of its transform is not finite',
    ): "Streifen „{strip}“: eine Zahl seiner Transformation ist nicht endlich",
    (
        "*",
        'strip "{strip}" is too small to find its scribbles',
    ): "Streifen „{strip}“ ist zu klein, um seine Markierungen zu finden",
    (
        "*",
        'strip "{strip}" lies at frames {first} to {last}, where no timeline is',
    ): "Streifen „{strip}“ liegt bei den Bildern {first} bis {last}, wo keine Zeitleiste ist",
    (
        "*",
        'mask "{mask}": a point, a feather or an opacity is not a usable number',
    ): "Maske „{mask}“: ein Punkt, eine weiche Kante oder eine Deckkraft ist keine brauchbare Zahl",
    (
        "*",
        'mask "{mask}": parents of its points are not followed, but a film of its Mask strip can be the matte',
    ): "Maske „{mask}“: den Eltern ihrer Punkte wird nicht gefolgt, aber ein Film ihres Maskenstreifens kann die Matte"
    " sein",
    (
        "*",
        'mask "{mask}": its shape keys cannot be read in this version of Blender, but a film of its Mask strip can'
        " be the matte",
    ): "Maske „{mask}“: ihre Formschlüssel sind in dieser Version von Blender nicht lesbar, aber ein Film ihres"
    " Maskenstreifens kann die Matte sein",
    (
        "*",
        'strip "{strip}": its retiming keys cannot be read in this version of Blender, so it is shown at an even speed;'
        " keys of Source Time can take their place",
    ): "Streifen „{strip}“: seine Retiming-Schlüssel sind in dieser Version von Blender nicht lesbar, darum läuft er"
    " gleichmäßig; Schlüssel der Quellzeit können an ihre Stelle treten",
    (
        "*",
        'In the color space "{space}" Blender\'s sequencer changes colors where it lays strips over others: set the'
        " blend mode of the Shutter strip to Replace",
    ): "Im Farbraum „{space}“ ändert Blenders Sequencer Farben, wo er Streifen über andere legt: den Mischmodus des"
    " Shutter-Streifens auf Ersetzen stellen",
    ("*", 'strip "{strip}" has no files'): "Streifen „{strip}“ hat keine Dateien",
    ("*", 'strip "{strip}" has no clip'): "Streifen „{strip}“ hat keinen Clip",
    (
        "*",
        'strip "{strip}": undistorted or stabilized clips are not supported',
    ): "Streifen „{strip}“: entzerrte oder stabilisierte Clips werden nicht unterstützt",
    # The effect and its source
    ("Operator", "Match Source"): "An Quelle angleichen",
    (
        "*",
        "Give the Shutter strip transform, crop, flip, color and range of its source (scribbles stay on the picture)",
    ): "Dem Verschlussstreifen Transformation, Beschnitt, Spiegelung, Farbe und Bereich seiner Quelle geben "
    "(Markierungen bleiben auf dem Bild)",
    ("*", "Differs from its source: {what}"): "Weicht von der Quelle ab: {what}",
    ("*", "transform"): "Transformation",
    ("*", "crop"): "Beschnitt",
    ("*", "flip"): "Spiegelung",
    ("*", "color"): "Farbe",
    ("*", "range"): "Bereich",
    ("*", "The Shutter strip is like its source"): "Der Verschlussstreifen ist wie seine Quelle",
    ("*", "The Shutter strip has no source any more"): "Der Verschlussstreifen hat keine Quelle mehr",
    (
        "*",
        '"{neighbor}" is in the way: "{strip}" has not the whole range of its source',
    ): "„{neighbor}“ ist im Weg: „{strip}“ hat nicht den ganzen Bereich seiner Quelle",
    ("Operator", "Copy Modifiers"): "Modifikatoren kopieren",
    (
        "*",
        "Copy the modifiers of the source to the Shutter strip, which shows the source's file as it is",
    ): "Die Modifikatoren der Quelle auf den Verschlussstreifen kopieren, der die Datei der Quelle zeigt, wie sie ist",
    ("*", "Modifiers of the source do not reach the effect"): "Modifikatoren der Quelle erreichen den Effekt nicht",
    (
        "*",
        "The Shutter strip has the modifiers of its source",
    ): "Der Verschlussstreifen hat die Modifikatoren seiner Quelle",
    (
        "*",
        "Effect strips on the source do not reach the effect: make the Shutter strip their input",
    ): "Effektstreifen auf der Quelle erreichen den Effekt nicht: den Verschlussstreifen zu ihrer Eingabe machen",
    # Shutters
    ("Operator", "Add Shutter"): "Verschluss hinzufügen",
    ("*", "Add a shutter that is fully open"): "Einen Verschluss hinzufügen, der ganz offen ist",
    ("Operator", "Duplicate Shutter"): "Verschluss duplizieren",
    (
        "*",
        "Add a copy of the active shutter, keyframes included",
    ): "Eine Kopie des aktiven Verschlusses samt Schlüsselbildern hinzufügen",
    ("Operator", "Remove Shutter"): "Verschluss entfernen",
    ("*", "Remove the active shutter and its regions"): "Den aktiven Verschluss und seine Regionen entfernen",
    ("*", "The last shutter of an effect cannot be removed"): "Der letzte Verschluss eines Effekts bleibt",
    ("Operator", "Move Shutter"): "Verschluss verschieben",
    ("Operator", "Move Up"): "Nach oben",
    ("Operator", "Move Down"): "Nach unten",
    (
        "*",
        "Move the active shutter in the list (the first one is the default, which holds where nothing is scribbled)",
    ): "Den aktiven Verschluss in der Liste verschieben (der erste ist der Standard und gilt, wo nichts markiert ist)",
    ("*", "Direction"): "Richtung",
    ("*", "Up"): "Hoch",
    ("*", "Down"): "Herunter",
    ("*", "Active Shutter"): "Aktiver Verschluss",
    ("*", "Name of the shutter"): "Name des Verschlusses",
    ("*", "Color"): "Farbe",
    (
        "*",
        "Color of the shutter's bars, scribbles and matte",
    ): "Farbe der Balken, Markierungen und Matte des Verschlusses",
    ("*", "The effect has no shutter: add one"): "Der Effekt hat keinen Verschluss: einen hinzufügen",
    ("*", 'shutter "{name}" at frame {frame}: {fault}'): "Verschluss „{name}“ bei Bild {frame}: {fault}",
    ("*", "all bars are zero: the shutter never opens"): "alle Balken sind null, der Verschluss öffnet nie",
    ("*", "a bar is negative"): "ein Balken ist negativ",
    ("*", "a bar is not a finite number"): "ein Balken ist keine endliche Zahl",
    ("*", "a bar is above a million"): "ein Balken ist größer als eine Million",
    (
        "*",
        "the bars are less than a millionth together: the shutter never opens",
    ): "die Balken sind zusammen weniger als ein Millionstel, der Verschluss öffnet nie",
    # Presets
    ("Operator", "Apply Shutter Preset"): "Verschluss-Voreinstellung anwenden",
    (
        "*",
        "Give the active shutter the bars of a preset",
    ): "Dem aktiven Verschluss die Balken einer Voreinstellung geben",
    ("Virtual Shutter", "Preset"): "Voreinstellung",
    ("Virtual Shutter", "Still Frame"): "Standbild",
    ("*", "The shown frame alone"): "Nur das gezeigte Bild",
    ("Virtual Shutter", "45°"): "45°",
    ("*", "Open for an eighth of the frames"): "Ein Achtel der Bilder lang offen",
    ("Virtual Shutter", "90°"): "90°",
    ("*", "Open for a quarter of the frames"): "Ein Viertel der Bilder lang offen",
    ("Virtual Shutter", "180°"): "180°",
    (
        "*",
        "Open for half of the frames, as film cameras are",
    ): "Die Hälfte der Bilder lang offen, wie bei Filmkameras",
    ("Virtual Shutter", "270°"): "270°",
    ("*", "Open for three quarters of the frames"): "Drei Viertel der Bilder lang offen",
    ("Virtual Shutter", "360°"): "360°",
    ("*", "Open for all frames"): "Alle Bilder lang offen",
    ("Virtual Shutter", "Two Cuts"): "Zwei Schlitze",
    ("*", "Two frames on top of each other"): "Zwei Bilder übereinander",
    ("Virtual Shutter", "Four Cuts"): "Vier Schlitze",
    ("*", "Four frames on top of each other"): "Vier Bilder übereinander",
    ("Virtual Shutter", "Ramp Up"): "Rampe aufwärts",
    (
        "*",
        "Opens from frame to frame: a trail with a sharp end",
    ): "Öffnet von Bild zu Bild: eine Spur mit scharfem Ende",
    ("Virtual Shutter", "Ramp Down"): "Rampe abwärts",
    (
        "*",
        "Closes from frame to frame: a trail with a sharp start",
    ): "Schließt von Bild zu Bild: eine Spur mit scharfem Anfang",
    ("Virtual Shutter", "Triangle"): "Dreieck",
    (
        "*",
        "Opens to the middle frame and closes again",
    ): "Öffnet bis zum mittleren Bild und schließt wieder",
    ("Virtual Shutter", "Gaussian"): "Gaußkurve",
    ("*", "A bell curve around the middle frame"): "Eine Glockenkurve um das mittlere Bild",
    ("Virtual Shutter", "Exponential Trail"): "Exponentielle Spur",
    ("*", "Fades quickly at first and slowly later on"): "Verblasst erst schnell und dann langsam",
    ("Virtual Shutter", "Stutter"): "Stottern",
    ("*", "Every fourth frame, as a strobe lights them"): "Jedes vierte Bild, wie von einem Stroboskop beleuchtet",
    ("Virtual Shutter", "First Frame"): "Erstes Bild",
    ("*", "The first of the frames alone"): "Nur das erste der Bilder",
    ("Virtual Shutter", "Last Frame"): "Letztes Bild",
    ("*", "The last of the frames alone"): "Nur das letzte der Bilder",
    # Bars
    ("Operator", "Insert Bar Keyframes"): "Schlüsselbilder der Balken einfügen",
    (
        "*",
        "Insert keyframes for all bars of the active shutter at the current frame",
    ): "Schlüsselbilder für alle Balken des aktiven Verschlusses beim aktuellen Bild einfügen",
    ("Operator", "Delete Bar Keyframes"): "Schlüsselbilder der Balken löschen",
    (
        "*",
        "Delete the keyframes of all bars of the active shutter at the current frame",
    ): "Die Schlüsselbilder aller Balken des aktiven Verschlusses beim aktuellen Bild löschen",
    ("*", "No bar has a keyframe at the current frame"): "Kein Balken hat beim aktuellen Bild ein Schlüsselbild",
    ("Operator", "Set Bar Weight"): "Balkengewicht setzen",
    ("*", "Set the weight of a bar as a number"): "Das Gewicht eines Balkens als Zahl setzen",
    ("*", "Bar {number}"): "Balken {number}",
    ("*", "Bar"): "Balken",
    ("*", "Number of the bar, from 1"): "Nummer des Balkens, ab 1",
    ("*", "Weight"): "Gewicht",
    ("*", "How much the bar's frame contributes"): "Wie viel das Bild des Balkens beiträgt",
    ("*", "The shutter has {count} bars"): "Der Verschluss hat {count} Balken",
    ("Operator", "Paint Bars"): "Balken malen",
    # Regions
    ("*", "{combine} of 1 frame"): "{combine} von 1 Bild",
    ("*", "{combine} of {count} frames"): "{combine} von {count} Bildern",
    ("*", "Combine"): "Verrechnen",
    ("*", "What the frames that are exposed become"): "Was aus den belichteten Bildern wird",
    ("*", "Average"): "Mittelwert",
    ("*", "The average of the frames, as a camera makes it"): "Der Mittelwert der Bilder, wie ihn eine Kamera macht",
    ("*", "Lightest"): "Hellstes",
    (
        "*",
        "What is lightest in any of them: a trail of light, as bright however long it is",
    ): "Was in einem von ihnen am hellsten ist: eine Lichtspur, gleich hell, so lang sie auch ist",
    ("*", "Darkest"): "Dunkelstes",
    ("*", "What is darkest in any of them"): "Was in einem von ihnen am dunkelsten ist",
    ("*", "Median"): "Median",
    (
        "*",
        "What most of them show: who passes by is gone",
    ): "Was die meisten von ihnen zeigen: Wer vorbeigeht, ist weg",
    ("*", "By Luminance"): "Nach Luminanz",
    (
        "*",
        "Choose a frame for each pixel, by how light it is there, and not one for each color channel",
    ): "Für jedes Pixel ein Bild wählen, danach, wie hell es dort ist, und nicht für jeden Farbkanal eines",
    ("*", "Use Threshold"): "Schwelle verwenden",
    (
        "*",
        "Let only what is lighter, or of the darkest darker, leave a trail beside what is shown",
    ): "Nur was heller ist, oder beim Dunkelsten dunkler, neben dem Gezeigten eine Spur hinterlassen lassen",
    ("*", "Threshold"): "Schwelle",
    (
        "*",
        "Luminance of linear light from which on it leaves a trail; white is 1",
    ): "Luminanz linearen Lichts, von der an es eine Spur hinterlässt; Weiß ist 1",
    ("*", "Softness"): "Weichheit",
    (
        "*",
        "Range of luminance, around the threshold, over which a trail fades in",
    ): "Bereich der Luminanz um die Schwelle, über den eine Spur einblendet",
    ("Operator", "Draw"): "Zeichnen",
    ("Operator", "Draw Outline"): "Umriss zeichnen",
    (
        "*",
        "Draw on the sharp frame where the active shutter holds (at another frame, this redraws the active region)",
    ): "Auf dem scharfen Bild zeichnen, wo der aktive Verschluss gilt (bei einem anderen Bild zeichnet das die aktive "
    "Region neu)",
    ("Operator", "Draw Shutter"): "Verschluss zeichnen",
    (
        "*",
        "The sharp frame, to draw on: the result comes with the stroke",
    ): "Das scharfe Bild, zum Zeichnen: Das Ergebnis kommt mit dem Strich",
    ("*", "New Region"): "Neue Region",
    (
        "*",
        "Start a new region instead of adding strokes to the active one",
    ): "Eine neue Region beginnen, statt der aktiven Striche hinzuzufügen",
    ("*", "Open a sequencer with a preview to draw"): "Zum Zeichnen einen Sequenzer mit Vorschau öffnen",
    ("Operator", "Erase"): "Radieren",
    (
        "*",
        "Erase strokes of the active region in the preview",
    ): "Striche der aktiven Region in der Vorschau ausradieren",
    ("*", "Open a sequencer with a preview to erase"): "Zum Radieren einen Sequenzer mit Vorschau öffnen",
    ("Operator", "Add Region from Annotation Layer"): "Region aus Anmerkungsebene hinzufügen",
    (
        "*",
        "Make an annotation layer of the preview a region of the active shutter",
    ): "Eine Anmerkungsebene der Vorschau zu einer Region des aktiven Verschlusses machen",
    (
        "*",
        "The preview shows no annotation layer that is not a region yet",
    ): "Die Vorschau zeigt keine Anmerkungsebene, die noch keine Region ist",
    ("Operator", "Assign Region to Shutter"): "Region einem Verschluss zuweisen",
    ("*", "Assign the active region to another shutter"): "Die aktive Region einem anderen Verschluss zuweisen",
    ("Operator", "Remove Region"): "Region entfernen",
    ("*", "Remove the active region and its strokes"): "Die aktive Region und ihre Striche entfernen",
    ("Operator", "Move Region"): "Region verschieben",
    (
        "*",
        "Move the active region in the list (later ones lie over earlier ones)",
    ): "Die aktive Region in der Liste verschieben (spätere liegen über früheren)",
    ("Operator", "Insert Region Keyframes"): "Schlüsselbilder der Region einfügen",
    (
        "*",
        "Insert keyframes for location, rotation and scale of the active region at the current frame",
    ): "Schlüsselbilder für Position, Rotation und Skalierung der aktiven Region beim aktuellen Bild einfügen",
    ("*", "The shutter has no region: draw one"): "Der Verschluss hat keine Region: eine zeichnen",
    ("*", "Active Region"): "Aktive Region",
    ("*", "Name of the region"): "Name der Region",
    ("*", "Name of the shutter that holds in the region"): "Name des Verschlusses, der in der Region gilt",
    ("*", "Layer"): "Ebene",
    ("*", "Annotation layer that holds the strokes"): "Anmerkungsebene, die die Striche enthält",
    ("Virtual Shutter", "Type"): "Typ",
    ("*", "How the strokes cover the picture"): "Wie die Striche das Bild bedecken",
    ("Virtual Shutter", "Line"): "Linie",
    (
        "*",
        "The strokes themselves, as wide as the region's width",
    ): "Die Striche selbst, so breit wie die Breite der Region",
    ("Virtual Shutter", "Lasso"): "Lasso",
    ("*", "All that the strokes enclose"): "Alles, was die Striche umschließen",
    (
        "*",
        "Tracking the outline: {done} of {total} frames",
    ): "Der Umriss wird verfolgt: {done} von {total} Frames",
    ("Virtual Shutter", "Outline"): "Umriss",
    (
        "*",
        "What closed curves enclose, to the pixel: a matte that is drawn",
    ): "Was geschlossene Kurven umschließen, auf den Pixel genau: eine gezeichnete Matte",
    ("*", "In Between"): "Dazwischen",
    ("*", "What gives the matte between two drawings"): "Woraus die Matte zwischen zwei Zeichnungen entsteht",
    ("*", "Tracked"): "Verfolgt",
    (
        "*",
        "The outline follows the footage's own motion from both drawings",
    ): "Der Umriss folgt von beiden Zeichnungen aus der Bewegung im Material selbst",
    (
        "*",
        "Curves go straight from one drawing to the next",
    ): "Kurven gehen gerade von einer Zeichnung zur nächsten",
    (
        "*",
        "Tracking the outline: {done} of {total} frames, Esc to stop",
    ): "Der Umriss wird verfolgt: {done} von {total} Frames, Esc hält an",
    ("*", "Shutter Outline"): "Shutter-Umriss",
    ("Operator", "Track Outline"): "Umriss verfolgen",
    (
        "*",
        "Track the active outline through its strip now (Esc stops and keeps the tracked frames)",
    ): "Den aktiven Umriss jetzt durch seinen Streifen verfolgen (Esc hält an und behält die verfolgten Bilder)",
    ("Operator", "Next Drawing Needed"): "Nächste nötige Zeichnung",
    (
        "*",
        "Go to the frame that needs a drawing most, after tracking the outline",
    ): "Zur Mitte der Frames gehen, in denen der Umriss am unsichersten ist; er wird vorher verfolgt",
    ("Operator", "Insert Outline Drawing"): "Umrisszeichnung einfügen",
    (
        "*",
        "Turn the tracked outline at the current frame into a drawing that can be edited",
    ): "Den Umriss, der zum aktuellen Frame verfolgt ist, zu einer eigenen Zeichnung machen, um ihn auszubessern",
    (
        "*",
        "Frame {frame}: the confidence is {share:.0f} %",
    ): "Frame {frame}: Der Umriss ist zu {share:.0f} % sicher",
    (
        "*",
        "The confidence is 75 % or more at all frames",
    ): "Die Sicherheit ist in allen Bildern 75 % oder mehr",
    ("*", "The outline is empty at the current frame"): "Der Umriss umschließt im aktuellen Frame nichts",
    ("*", "The region is not an outline"): "Die Region ist kein Umriss",
    ("*", 'strip "{strip}" is scaled to nothing'): "Streifen „{strip}“ ist zu nichts skaliert",
    ("*", "{place}: a linear outline is not tracked"): "{place}: Ein linearer Umriss wird nicht verfolgt",
    ("Operator", "Edit Outline"): "Umriss ausbessern",
    ("*", "Folder"): "Ordner",
    ("*", "Format"): "Format",
    ("*", "OpenEXR"): "OpenEXR",
    ("*", "PNG"): "PNG",
    ("Operator", "Export Matte"): "Matte exportieren",
    (
        "*",
        "Write the active matte or outline as pictures, one for each frame of its strip, for other programs",
    ): "Was die aktive Matte oder der aktive Umriss in jedem Frame zeigt, für andere Programme als Bilder schreiben",
    ("*", "File format of the pictures"): "Was die Bilder sind",
    ("*", "Grey, 16 bits"): "Grau, 16 Bit",
    ("*", "Float, in the channel Y"): "Fließkomma, im Kanal Y",
    ("*", "The region is not a matte, ramp or outline"): "Die Region ist keine Matte, keine Rampe und kein Umriss",
    ("*", 'Saved {count} pictures in "{folder}"'): "{count} Bilder in „{folder}“ gespeichert",
    ("Operator", "Find Outline"): "Umriss finden",
    ("Operator", "Draw by Points"): "Punktweise zeichnen",
    (
        "*",
        "Draw a curve of the active outline point by point, along the picture's edges (Ctrl for straight lines)",
    ): "Eine Kurve des aktiven Umrisses Punkt für Punkt an den Kanten des Bildes entlang zeichnen (Strg für gerade"
    " Linien)",
    (
        "*",
        "Click points around the subject (arrow keys, Space), Ctrl: straight, Backspace: undo point, "
        "Return: close, Esc: cancel",
    ): "Punkte um das Motiv klicken (Pfeiltasten, Leertaste), Strg: gerade, Rücktaste: einer weniger, "
    "Eingabe: schließen, Esc: nichts",
    ("*", "A curve needs at least three points"): "Eine Kurve hat mindestens drei Punkte",
    ("Operator", "Outline to Mask"): "Umriss zu Maske",
    ("Operator", "Outline from Mask"): "Umriss aus Maske",
    (
        "*",
        "Make a Blender mask with shape keys of the active outline, after tracking it",
    ): "Aus dem aktiven Umriss eine Blender-Maske mit Formschlüsseln machen; zuvor wird er verfolgt",
    (
        "*",
        "Make an outline of the active shutter with a drawing at each key of a mask",
    ): "Einen Umriss des aktiven Verschlusses machen, der an jedem Schlüssel einer Maske gezeichnet ist",
    ("*", "Every"): "Jedes",
    (
        "*",
        "Frames from one shape key to the next between drawings of a tracked outline; 0 for drawings alone",
    ): "Bilder von einem Formschlüssel zum nächsten zwischen den Zeichnungen eines verfolgten Umrisses; 0 nur für die"
    " Zeichnungen",
    ("*", 'Made the mask "{mask}"'): "Maske „{mask}“ gemacht",
    ("*", "Nothing is drawn in the outline"): "Im Umriss ist nichts gezeichnet",
    (
        "*",
        'mask "{mask}" encloses nothing in the strip',
    ): "Maske „{mask}“ umschließt im Streifen nichts",
    (
        "*",
        "A mask is written in a window of Blender, and there is none",
    ): "Eine Maske wird in einem Fenster von Blender geschrieben, und es gibt keines",
    (
        "*",
        "Make the active region an outline of the subject that its strokes mark or enclose at this frame",
    ): "Die aktive Region zum Umriss des Motivs machen, über das ihre Striche in diesem Frame laufen oder das sie"
    " umgeben",
    ("*", "No subject stands out from its surroundings"): "Kein Motiv hebt sich von dem ab, was darum herum ist",
    ("*", "The region has no strokes at the current frame"): "Die Region hat im aktuellen Frame keine Striche",
    ("*", "the outline encloses nothing here"): "der Umriss umschließt hier nichts",
    ("*", "Width"): "Breite",
    ("*", "Width of the lines as a fraction of the picture's height"): "Breite der Linien als Bruchteil der Bildhöhe",
    ("*", "Location"): "Position",
    (
        "*",
        "Distance from where the region was drawn, as a fraction of the picture",
    ): "Abstand vom Ort, an dem die Region gezeichnet wurde, als Bruchteil des Bildes",
    ("*", "Rotation"): "Rotation",
    ("*", "Rotation about the region's center"): "Rotation um die Mitte der Region",
    ("Operator", "Transform Region"): "Region transformieren",
    ("*", "Location X"): "Position X",
    ("*", "Location Y"): "Position Y",
    (
        "*",
        "Move, turn and scale the active region by numbers, as its handles in the preview do",
    ): "Die aktive Region durch Zahlen bewegen, drehen und skalieren, wie es ihre Griffe in der Vorschau tun",
    ("*", "Scale"): "Skalieren",
    ("*", "Scale about the region's center"): "Skalierung um die Mitte der Region",
    # Mattes and ramps
    ("Operator", "Matte from File"): "Matte aus Datei",
    (
        "*",
        "Make a movie, an image sequence or a picture the matte of the active shutter",
    ): "Einen Film, eine Bildsequenz oder ein Bild zur Matte des aktiven Verschlusses machen",
    ("Operator", "Matte from Strip"): "Matte aus Streifen",
    (
        "*",
        "Make a movie, image or clip strip of the edit the matte of the active shutter, muted or not",
    ): "Einen Film-, Bild- oder Clipstreifen des Schnitts zur Matte des aktiven Verschlusses machen, stumm oder nicht",
    ("Operator", "Matte from Mask"): "Matte aus Maske",
    ("*", "Make a mask the matte of the active shutter"): "Eine Maske zur Matte des aktiven Verschlusses machen",
    (
        "*",
        "There is no mask: draw one in the Mask mode of an image or clip",
    ): "Es gibt keine Maske: eine im Maskenmodus eines Bildes oder Clips zeichnen",
    ("Operator", "Ramp"): "Verlauf",
    (
        "*",
        "Make a ramp across the picture the matte of the active shutter",
    ): "Einen Verlauf über das Bild zur Matte des aktiven Verschlusses machen",
    ("Operator", "Time Map"): "Zeitkarte",
    (
        "*",
        "Show every pixel at its own moment: a ramp from the first of the frames to the last (slit-scan)",
    ): "Jeden Pixel zu seinem eigenen Zeitpunkt zeigen: ein Verlauf vom ersten der Bilder zum letzten (Slit-Scan)",
    ("*", "First"): "Erstes",
    ("*", "Last"): "Letztes",
    ("*", "Time Map"): "Zeitkarte",
    # Rolling shutter
    ("Operator", "Rolling Shutter Repair"): "Rolling Shutter ausgleichen",
    (
        "*",
        "Show every row as it was when the middle one was filmed: straight, where a rolling shutter has skewed it",
    ): "Jede Zeile so zeigen, wie sie war, als die mittlere gefilmt wurde, so dass gerade ist, was ein Rolling Shutter"
    " verzerrt hat",
    ("Virtual Shutter", "Read First"): "Zuerst gelesen",
    (
        "*",
        "The side of the picture that the sensor reads first",
    ): "Seite des gefilmten Bildes, die der Sensor zuerst ausliest",
    ("Virtual Shutter", "Top"): "Oben",
    ("*", "Rows are read downward, as most cameras do"): "Zeilen werden abwärts gelesen, wie von den meisten Kameras",
    ("Virtual Shutter", "Bottom"): "Unten",
    (
        "*",
        "Rows are read upward, as by a camera that hung upside down",
    ): "Zeilen werden aufwärts gelesen, wie von einer Kamera, die kopfüber hing",
    ("Virtual Shutter", "Left"): "Links",
    (
        "*",
        "Columns are read, from the left, as by a camera that was turned",
    ): "Spalten werden von links gelesen, wie von einer Kamera, die gedreht war",
    ("Virtual Shutter", "Right"): "Rechts",
    (
        "*",
        "Columns are read, from the right, as by a camera that was turned",
    ): "Spalten werden von rechts gelesen, wie von einer Kamera, die gedreht war",
    ("Virtual Shutter", "Unit"): "Einheit",
    ("*", "Unit of the readout"): "Worin die Auslesezeit gezählt wird",
    ("Virtual Shutter", "Percent"): "Prozent",
    (
        "*",
        "Of the time from a filmed frame to the next",
    ): "Der Zeit von einem gefilmten Bild zum nächsten",
    ("Virtual Shutter", "Milliseconds"): "Millisekunden",
    ("*", "A time, as tables of cameras have it"): "Eine Zeit, wie sie in Tabellen von Kameras steht",
    ("*", "Readout"): "Auslesezeit",
    (
        "*",
        "Time from reading the first row to the last, as a percentage of a frame",
    ): "Zeit von der ersten Zeile zur letzten, als Anteil der Zeit von einem gefilmten Bild zum nächsten",
    (
        "*",
        "Time from the first row to the last, in milliseconds",
    ): "Zeit von der ersten Zeile zur letzten, in Millisekunden",
    ("Operator", "Find Readout"): "Auslesezeit finden",
    (
        "*",
        "Find the sensor's readout time from lines that lean while they move around the current frame, and repair it",
    ): "Finden, wie lange der Sensor ausliest, an Linien, die sich um den aktuellen Frame beim Bewegen neigen, und das"
    " ausgleichen",
    ("Virtual Shutter", "Reads"): "Liest",
    ("*", "Whether the sensor reads row by row or column by column"): "Was der Sensor nacheinander ausliest",
    ("Virtual Shutter", "Rows"): "Zeilen",
    ("*", "Upright lines lean as they move sideways"): "Senkrechte Linien neigen sich, wenn sie sich seitwärts bewegen",
    ("Virtual Shutter", "Columns"): "Spalten",
    (
        "*",
        "Level lines lean as they move up and down: of a camera that was turned",
    ): "Waagrechte Linien neigen sich, wenn sie sich auf und ab bewegen: bei einer gedrehten Kamera",
    (
        "*",
        "Readout of {percent} % of a frame, read first: {side}",
    ): "Auslesezeit von {percent} % eines Bildes, zuerst gelesen: {side}",
    ("*", "Earlier"): "Früher",
    ("*", "Later"): "Später",
    ("*", "Rolling Shutter"): "Rolling Shutter",
    (
        "*",
        "{time} ms is longer than a frame of the footage, {longest} ms",
    ): "{time} ms sind länger als ein Bild des Filmmaterials, {longest} ms",
    ("*", "the readout cannot be found here: {why}"): "die Auslesezeit lässt sich hier nicht finden: {why}",
    ("*", "there are too few frames"): "es gibt zu wenige Bilder",
    ("*", "too few straight lines go across the picture"): "zu wenige gerade Linien gehen durch das Bild",
    ("*", "lines move too little, or always alike"): "Linien bewegen sich zu wenig oder immer gleich",
    (
        "*",
        "lines do not lean as one readout would have them",
    ): "Linien neigen sich nicht, wie eine einzige Auslesezeit es täte",
    (
        "*",
        "lines stand upright however they move: there is no rolling shutter to repair",
    ): "Linien bleiben gerade, wie sie sich auch bewegen: Es gibt keinen Rolling Shutter auszugleichen",
    ("*", "Region Specials"): "Regions-Spezialmenü",
    (
        "*",
        "The region is a matte or a ramp, and has no strokes",
    ): "Die Region ist eine Matte oder ein Verlauf und hat keine Striche",
    ("*", "What says where the shutter holds"): "Was sagt, wo der Verschluss gilt",
    ("Virtual Shutter", "Matte"): "Matte",
    (
        "*",
        "What a file, a strip or a mask says for every pixel",
    ): "Was eine Datei, ein Streifen oder eine Maske für jeden Pixel sagt",
    ("Virtual Shutter", "Ramp"): "Verlauf",
    (
        "*",
        "From none of the shutter to all of it, across the picture",
    ): "Über das Bild von nichts vom Verschluss bis zum ganzen",
    ("*", "From"): "Von",
    ("*", "What the matte is"): "Was die Matte ist",
    ("*", "File"): "Datei",
    ("*", "A movie, an image sequence or a picture"): "Ein Film, eine Bildsequenz oder ein Bild",
    ("*", "Movie, image sequence or picture that is the matte"): "Film, Bildsequenz oder Bild, das die Matte ist",
    ("*", "Strip"): "Streifen",
    (
        "*",
        "A movie, image or clip strip of the edit, as it is trimmed and retimed, muted or not",
    ): "Ein Film-, Bild- oder Clipstreifen des Schnitts mit seinen Trims und seiner geänderten Zeit, stumm oder nicht",
    ("*", "Identity of the strip that is the matte"): "Kennung des Streifens, der die Matte ist",
    ("*", "Strip that is the matte"): "Streifen, der die Matte ist",
    ("*", "Mask"): "Maske",
    (
        "*",
        "A mask, as a Mask strip on the footage shows it",
    ): "Eine Maske, wie ein Maskenstreifen über dem Filmmaterial sie zeigt",
    ("*", "Mask that is the matte"): "Maske, die die Matte ist",
    ("*", "Channel"): "Kanal",
    (
        "*",
        "What of the matte says how much of the shutter a pixel gets",
    ): "Was an der Matte sagt, wie viel vom Verschluss ein Pixel bekommt",
    ("*", "Luminance"): "Leuchtdichte",
    ("*", "How bright the matte is"): "Wie hell die Matte ist",
    ("*", "Red"): "Rot",
    ("*", "The matte's red"): "Das Rot der Matte",
    ("*", "Green"): "Grün",
    ("*", "The matte's green"): "Das Grün der Matte",
    ("*", "Blue"): "Blau",
    ("*", "The matte's blue"): "Das Blau der Matte",
    ("*", "Alpha"): "Alpha",
    ("*", "How opaque the matte is"): "Wie deckend die Matte ist",
    ("*", "Named"): "Benannt",
    ("*", "A channel of an EXR file, by its name"): "Ein Kanal einer EXR-Datei, nach seinem Namen",
    ("*", "Channel Name"): "Kanalname",
    (
        "*",
        "Name of a channel of an EXR file; empty for the luminance",
    ): "Name eines Kanals einer EXR-Datei; leer für die Leuchtdichte",
    ("*", "Name of the channel in the EXR file"): "Name des Kanals in der EXR-Datei",
    ("*", "Invert"): "Invertieren",
    ("*", "The shutter gets what the matte leaves"): "Der Verschluss bekommt, was die Matte übrig lässt",
    ("*", "Frames Of"): "Bilder von",
    ("*", "What the matte's frames belong to"): "Wozu die Bilder der Matte gehören",
    ("*", "Footage"): "Filmmaterial",
    (
        "*",
        "The matte's frames belong to those of the footage, however that is trimmed and retimed",
    ): "Die Bilder der Matte gehören zu denen des Filmmaterials, auch wenn es getrimmt oder seine Zeit geändert ist",
    ("*", "Timeline"): "Zeitleiste",
    (
        "*",
        "The matte plays along the timeline, from where the Shutter strip starts untrimmed",
    ): "Die Matte läuft mit der Zeitleiste, vom ungetrimmten Anfang des Verschlussstreifens an",
    ("*", "Offset"): "Versatz",
    ("*", "Frames by which the matte is ahead"): "Bilder, um die die Matte voraus ist",
    ("Virtual Shutter", "Blend"): "Mischmodus",
    ("*", "How the matte lies over other regions"): "Wie die Matte über anderen Regionen liegt",
    ("Virtual Shutter", "Over"): "Über",
    ("*", "What is beneath shares what the matte leaves"): "Was darunter liegt, teilt sich, was die Matte übrig lässt",
    ("Virtual Shutter", "Add"): "Addieren",
    (
        "*",
        "What the matte takes comes from the default shutter alone, so that mattes stand side by side",
    ): "Was die Matte nimmt, kommt allein vom Standardverschluss, sodass Matten nebeneinander stehen",
    ("*", "Opacity"): "Deckkraft",
    (
        "*",
        "How much of the region counts: at 0 the picture is as without it",
    ): "Wie viel von der Region zählt: Bei 0 ist das Bild wie ohne sie",
    ("Virtual Shutter", "Feather"): "Weiche Kante",
    (
        "*",
        "How wide a hard edge of the matte becomes, as a fraction of the picture's height",
    ): "Wie breit eine harte Kante der Matte wird, als Bruchteil der Bildhöhe",
    ("*", "Ramp"): "Verlauf",
    ("*", "How the ramp runs"): "Wie der Verlauf läuft",
    ("*", "From the left to the right; its rotation turns it"): "Von links nach rechts; seine Rotation dreht ihn",
    ("*", "Radial"): "Radial",
    ("*", "From the center to the farthest corner"): "Von der Mitte zur entferntesten Ecke",
    ("*", "Angle"): "Winkel",
    ("*", "Once around the center, clockwise from the top"): "Einmal um die Mitte, im Uhrzeigersinn von oben an",
    ("*", "How bright the shown frame is"): "Wie hell das gezeigte Bild ist",
    ("*", "{width} × {height}, {count} frames"): "{width} × {height}, {count} Bilder",
    ("*", "{width} × {height}, one picture"): "{width} × {height}, ein Bild",
    ("*", "Shorter than the film: its last frame holds"): "Kürzer als der Film: Ihr letztes Bild bleibt stehen",
    ("*", "Ends before the film: its last frame holds"): "Endet vor dem Film: Sein letztes Bild bleibt stehen",
    ("*", "{place}: it has no matte file"): "{place}: sie hat keine Mattendatei",
    (
        "*",
        '{place}: image "{image}" is not a movie, image sequence or picture on disk',
    ): "{place}: Bild „{image}“ ist kein Film, keine Bildsequenz und kein Bild auf einem Datenträger",
    ("*", "{place}: its channel has no name"): "{place}: ihr Kanal hat keinen Namen",
    ("*", "{place}: it has no matte strip"): "{place}: sie hat keinen Mattenstreifen",
    ("*", "{place}: its matte strip was deleted"): "{place}: ihr Mattenstreifen wurde gelöscht",
    (
        "*",
        '{place}: its matte strip "{strip}" is not a movie, image or clip strip',
    ): "{place}: ihr Mattenstreifen „{strip}“ ist kein Film-, Bild- oder Clipstreifen",
    ("*", "{file}: Blender cannot read it ({error})"): "{file}: Blender kann es nicht lesen ({error})",
    (
        "*",
        "{folder}: its pictures are read by the effect; choose another name for the recipe",
    ): "{folder}: der Effekt liest Bilder darin; wählen Sie einen anderen Namen für das Rezept",
    ("*", "{place}: it has no mask"): "{place}: sie hat keine Maske",
    # Options
    ("Virtual Shutter", "Frames"): "Bilder",
    (
        "*",
        "Number of source frames that a shutter can expose",
    ): "Anzahl der Bilder der Quelle, die ein Verschluss belichten kann",
    ("*", "Position"): "Position",
    (
        "*",
        "Where the frames that are exposed lie around the shown one",
    ): "Wo die belichteten Bilder um das gezeigte liegen",
    ("*", "The shown frame is the first of them"): "Das gezeigte Bild ist ihr erstes",
    ("*", "Center"): "Zentrum",
    ("*", "The shown frame lies in their middle"): "Das gezeigte Bild liegt in ihrer Mitte",
    ("*", "End"): "Ende",
    ("*", "The shown frame is the last of them"): "Das gezeigte Bild ist ihr letztes",
    ("*", "Interpolation"): "Interpolation",
    (
        "*",
        "How shutters blend, in the picture and between keyframes",
    ): "Wie Verschlüsse ineinander übergehen, im Bild und zwischen Schlüsselbildern",
    ("*", "Displacement"): "Verschiebung",
    (
        "*",
        "Move times between shutters and between keyframes",
    ): "Zeiten zwischen Verschlüssen und zwischen Schlüsselbildern verschieben",
    ("*", "Value"): "Wert",
    (
        "*",
        "Cross-fade pictures between shutters, and fade every bar by itself between keyframes",
    ): "Bilder zwischen Verschlüssen und jeden Balken für sich zwischen Schlüsselbildern überblenden",
    ("*", "Light"): "Licht",
    ("*", "How the frames that are exposed are summed"): "Wie die belichteten Bilder summiert werden",
    ("*", "Linear"): "Linear",
    (
        "*",
        "Sum light as a camera does, so that bright streaks stay bright",
    ): "Licht wie eine Kamera summieren, so dass helle Spuren hell bleiben",
    ("*", "Encoded"): "Kodiert",
    (
        "*",
        "Sum the values that the footage is encoded with, which dims bright streaks",
    ): "Die Werte summieren, mit denen das Filmmaterial kodiert ist, was helle Spuren dämpft",
    ("Virtual Shutter", "Exposure"): "Belichtung",
    (
        "*",
        "How bright shutters are that are open for different times",
    ): "Wie hell Verschlüsse sind, die verschieden lange offen sind",
    ("Virtual Shutter", "Normalized"): "Normalisiert",
    ("*", "Every shutter gives the same brightness"): "Jeder Verschluss ergibt die gleiche Helligkeit",
    ("Virtual Shutter", "Weighted"): "Gewichtet",
    (
        "*",
        "A shutter that is open for less time than the default is darker, in linear light whatever is summed",
    ): "Ein Verschluss, der kürzer als der Standard offen ist, ist dunkler, in linearem Licht, was auch summiert wird",
    ("Virtual Shutter", "Clip Ends"): "Clip-Enden",
    (
        "*",
        "What an exposure gets that reaches beyond the ends of the clip, or of the shot",
    ): "Was eine Belichtung erhält, die über die Enden des Clips oder der Einstellung hinausreicht",
    ("Virtual Shutter", "Hold"): "Halten",
    (
        "*",
        "Repeat the first or last frame beyond the clip's ends",
    ): "Jenseits der Enden des Clips das erste oder letzte Bild wiederholen",
    ("Virtual Shutter", "Mirror"): "Spiegeln",
    ("*", "Play the clip backward beyond its ends"): "Den Clip jenseits seiner Enden rückwärts abspielen",
    ("Virtual Shutter", "Shorten"): "Kürzen",
    ("*", "Leave out what lies beyond the clip's ends"): "Weglassen, was jenseits der Enden des Clips liegt",
    ("Virtual Shutter", "Slide"): "Verschieben",
    (
        "*",
        "Move an exposure into the clip, by as many frames as it reaches beyond its ends",
    ): "Eine Belichtung in den Clip schieben, um so viele Bilder, wie sie über seine Enden hinausreicht",
    ("*", "Matte Resolution"): "Mattenauflösung",
    (
        "*",
        "Pixels that share a shutter (larger blocks are quicker)",
    ): "Pixel, die sich einen Verschluss teilen (größere Blöcke sind schneller)",
    ("*", "Full"): "Voll",
    ("*", "Every pixel has its own shutter"): "Jedes Pixel hat seinen eigenen Verschluss",
    ("*", "Half"): "Halb",
    ("*", "Blocks of 2×2 pixels share a shutter"): "Blöcke von 2×2 Pixeln teilen sich einen Verschluss",
    ("*", "Quarter"): "Viertel",
    ("*", "Blocks of 4×4 pixels share a shutter"): "Blöcke von 4×4 Pixeln teilen sich einen Verschluss",
    (
        "*",
        "Expose the region by itself, before all else, which is exposed without it: it leaves no ghost",
    ): "Die Region für sich belichten, vor allem anderen, das ohne sie belichtet wird: kein Geisterbild bleibt",
    ("*", "Clean Edges"): "Saubere Kanten",
    (
        "*",
        "Give layers, and what lies behind them, their own colors in the mixed pixels at their edges",
    ): "Ebenen und was hinter ihnen liegt behalten in den gemischten Pixeln an ihren Rändern ihre eigenen Farben",
    ("*", "Background Search"): "Hintergrundsuche",
    (
        "*",
        "Frames before and after the shown one in which what lies behind layers is looked for, "
        "where no exposed frame shows it",
    ): "Frames vor und nach dem gezeigten, die nach dem abgesucht werden, was Ebenen verdecken",
    ("*", "Stop at Cuts"): "An Schnitten enden",
    (
        "*",
        "Exposures end at the source's cuts as they do at the clip's ends",
    ): "Belichtungen enden an den Schnitten der Quelle wie an den Enden des Clips",
    ("*", "Keep Edges Default"): "Rand bleibt Standard",
    (
        "*",
        "Make the picture's edge a scribble of the default shutter, so that a stroke alone acts locally",
    ): "Den Bildrand zu einer Markierung des Standardverschlusses machen, so dass ein einzelner Strich örtlich wirkt",
    ("*", "Follow Edges"): "Kanten folgen",
    (
        "*",
        "How much shutters keep to the edges of the shown frame: at 1 a scribble fills what it lies in",
    ): "Wie sehr Verschlüsse den Kanten des gezeigten Bildes folgen: bei 1 füllt eine Markierung, worin sie liegt",
    # Smooth exposures
    ("*", "Smooth"): "Glätten",
    (
        "*",
        "Expose moments between filmed frames as well, which optical flow finds: light counts between two frames "
        "whose bars are both open",
    ): "Auch Zeitpunkte zwischen gefilmten Bildern belichten, die optischer Fluss findet: Licht zählt zwischen zwei "
    "Bildern, deren Balken beide offen sind",
    ("*", "Expose filmed frames alone"): "Nur gefilmte Bilder belichten",
    ("*", "2 moments from a filmed frame to the next"): "2 Zeitpunkte von einem gefilmten Bild zum nächsten",
    ("*", "4 moments from a filmed frame to the next"): "4 Zeitpunkte von einem gefilmten Bild zum nächsten",
    ("*", "8 moments from a filmed frame to the next"): "8 Zeitpunkte von einem gefilmten Bild zum nächsten",
    ("*", "16 moments from a filmed frame to the next"): "16 Zeitpunkte von einem gefilmten Bild zum nächsten",
    ("*", "Automatic"): "Automatisch",
    (
        "*",
        "As many moments as the fastest motion in the footage needs, 16 at most",
    ): "So viele Zeitpunkte, wie die schnellste Bewegung im Filmmaterial braucht, höchstens 16",
    (
        "*",
        "Expose moments between filmed frames as well, as many as the footage needs",
    ): "Auch Zeitpunkte zwischen gefilmten Bildern belichten, so viele, wie das Filmmaterial braucht",
    ("*", "The exposures are smooth"): "Die Belichtungen sind geglättet",
    ("*", "Skip Repeated Frames"): "Wiederholte Bilder überspringen",
    (
        "*",
        "Where Smooth is on, show moments between their neighbors in place of frames that repeat the one before, "
        "as in 24 frames per second that play at 30",
    ): "Wo Glätten an ist, statt Bildern, die das vorige wiederholen, Zeitpunkte zwischen ihren Nachbarn zeigen, etwa "
    "bei 24 Bildern pro Sekunde, die mit 30 laufen",
    (
        "*",
        "Frames of the source repeat: motion goes on across them",
    ): "Bilder der Quelle wiederholen sich: Die Bewegung läuft über sie hinweg",
    (
        "*",
        "Smooth is off: the nearest source frame is shown",
    ): "Glätten ist aus: Das nächste Bild der Quelle wird gezeigt",
    ("*", "Off"): "Aus",
    ("*", "2×"): "2×",
    ("*", "4×"): "4×",
    ("*", "8×"): "8×",
    ("*", "16×"): "16×",
    ("*", "{done} of {total}"): "{done} von {total}",
    ("Operator", "Smooth Streaks"): "Spuren glätten",
    ("*", "Too few frames: steps of {pixels} pixels"): "Zu wenige Bilder: Stufen von {pixels} Pixeln",
    # The live preview
    ("*", "Live"): "Live",
    (
        "*",
        "Show scribbles and views of the effect in the preview",
    ): "Markierungen und Ansichten des Effekts in der Vorschau zeigen",
    ("Virtual Shutter", "View"): "Ansicht",
    ("*", "What the live preview shows"): "Was die Live-Vorschau zeigt",
    ("Virtual Shutter", "Result"): "Ergebnis",
    ("*", "The finished picture"): "Das fertige Bild",
    ("Virtual Shutter", "Split"): "Geteilt",
    (
        "*",
        "The source on the left of the handle, the result on its right",
    ): "Links vom Griff die Quelle, rechts davon das Ergebnis",
    ("Virtual Shutter", "Scribbles"): "Markierungen",
    (
        "*",
        "The source, and where each shutter is scribbled",
    ): "Die Quelle, und wo jeder Verschluss markiert ist",
    ("Virtual Shutter", "Mattes"): "Matten",
    (
        "*",
        "How much of each shutter a pixel gets, in the shutters' colors and patterns",
    ): "Wie viel jedes Verschlusses ein Pixel erhält, in den Farben und Mustern der Verschlüsse",
    ("Virtual Shutter", "Edges"): "Ränder",
    (
        "*",
        "The result, and a line around what a shutter gets more than half of",
    ): "Das Ergebnis, und eine Linie um das, wovon ein Verschluss mehr als die Hälfte erhält",
    ("*", "Split Position"): "Teilung",
    (
        "*",
        "Where the source ends and the result begins, as a fraction of the picture's width",
    ): "Wo die Quelle endet und das Ergebnis beginnt, als Bruchteil der Bildbreite",
    ("*", "Probe"): "Sonde",
    (
        "*",
        "Show the shutter of the pixel that the pointer was over last, and how much of each it gets",
    ): "Verschluss des Pixels zeigen, über dem der Zeiger zuletzt war, und wie viel er von jedem erhält",
    ("*", "Probe Position"): "Ort der Sonde",
    (
        "*",
        "The pixel that is probed, in fractions of the picture from its lower left corner",
    ): "Das Pixel, das die Sonde zeigt, in Bruchteilen des Bildes von seiner unteren linken Ecke",
    ("*", "Shutter: {fault}"): "Verschluss: {fault}",
    ("*", "Preview: {what}"): "Vorschau: {what}",
    ("*", "{scale} of the size"): "{scale} der Größe",
    ("*", "from a proxy"): "aus einem Proxy",
    ("*", "a draft of the edges"): "Kanten im Entwurf",
    ("*", "Full quality, as it will be rendered"): "Volle Qualität, wie es gerendert wird",
    ("*", "Back"): "Zurück",
    ("*", "Full Quality"): "Volle Qualität",
    ("Operator", "Full Quality"): "Volle Qualität",
    (
        "*",
        "Show this frame as it will be rendered, each of its pixels on one of the screen's, or end that",
    ): "Dieses Bild zeigen, wie es gerendert wird, jedes seiner Pixel auf einem des Schirms, oder das beenden",
    ("*", "No preview shows a Shutter strip"): "Keine Vorschau zeigt einen Verschlussstreifen",
    ("*", "Buttons of Notes"): "Knöpfe an Hinweisen",
    ("*", "Composing…"): "Wird berechnet …",
    ("*", "The strips above are hidden in this view"): "Die Streifen darüber sind in dieser Ansicht verborgen",
    ("*", "This view has the view transform Standard"): "Diese Ansicht hat die Anzeigetransformation Standard",
    # Tracking and following
    ("Virtual Shutter", "Track"): "Verfolgen",
    ("Operator", "Track"): "Verfolgen",
    ("Operator", "Track Region"): "Region verfolgen",
    (
        "*",
        "Key the active region by what it covers here, up to your own keys (Esc stops and keeps the tracked frames)",
    ): "Der aktiven Region Schlüsselbilder nach dem geben, was sie hier bedeckt, bis zu den eigenen "
    "Schlüsselbildern (Esc hält an und behält die verfolgten Bilder)",
    ("Virtual Shutter", "Direction"): "Richtung",
    ("*", "Where tracking goes from the current frame"): "Wohin vom aktuellen Bild aus verfolgt wird",
    ("Virtual Shutter", "Backward"): "Rückwärts",
    ("*", "Towards the strip's first frame"): "Zum ersten Bild des Streifens hin",
    ("Virtual Shutter", "Both"): "Beide",
    ("*", "Towards both ends of the strip"): "Zu beiden Enden des Streifens hin",
    ("Virtual Shutter", "Forward"): "Vorwärts",
    ("*", "Towards the strip's last frame"): "Zum letzten Bild des Streifens hin",
    ("Virtual Shutter", "Motion"): "Bewegung",
    ("*", "Which channels Track and Follow key"): "Welchen Kanälen Verfolgen und Folgen Schlüsselbilder geben",
    ("Virtual Shutter", "Location"): "Position",
    ("*", "It is moved"): "Es wird bewegt",
    ("Virtual Shutter", "Location, Rotation"): "Position, Rotation",
    ("*", "It is moved and turned"): "Es wird bewegt und gedreht",
    ("Virtual Shutter", "Location, Rotation, Scale"): "Position, Rotation, Skalierung",
    ("*", "It is moved, turned and scaled"): "Es wird bewegt, gedreht und skaliert",
    ("Virtual Shutter", "Until"): "Bis",
    (
        "*",
        "Timeline frame at which tracking stops; 0 is the end of the strip",
    ): "Bild der Zeitleiste, bei dem das Verfolgen anhält; 0 ist das Ende des Streifens",
    ("*", "All Keys"): "Alle Schlüsselbilder",
    (
        "*",
        "Keep a key at every tracked frame, in place of those that the motion needs within a pixel",
    ): "Ein Schlüsselbild in jedem verfolgten Bild, statt derer, die die Bewegung auf ein Pixel genau braucht",
    ("*", "Tracking: {done} of {total} frames, Esc to stop"): "Verfolgt: {done} von {total} Bildern, Esc hält an",
    (
        "*",
        "Frames {first} to {last} are tracked",
    ): "Bilder {first} bis {last} sind verfolgt",
    (
        "*",
        "Track lost the subject at frame {frame}: move the region back onto it, there or where it is seen again, or"
        " outline it",
    ): "Verfolgen verlor das Motiv bei Bild {frame}: die Region dort oder, wo es wieder zu sehen ist, auf das Motiv"
    " ziehen, oder es umreißen",
    (
        "*",
        "From frame {frame} on, near and far move differently, or too little is seen: not all can be held still",
    ): "Ab Frame {frame} bewegen sich Nah und Fern verschieden, oder es ist zu wenig zu sehen: nicht alles steht still",
    ("Operator", "Outline This Subject"): "Dieses Motiv umreißen",
    (
        "*",
        "Timeline frame of the strokes; without one, the current frame",
    ): "Bild der Zeitleiste mit den Strichen; ohne eines das aktuelle",
    ("*", "Tracking stopped at frame {frame}: {fault}"): "Das Verfolgen hielt bei Bild {frame} an: {fault}",
    ("*", "Confidence"): "Sicherheit",
    ("*", "How sure tracking was of where it is"): "Wie sicher das Verfolgen war, wo es ist",
    ("*", "Confidence: {percent} %"): "Sicherheit: {percent} %",
    ("Operator", "Next Unsure Frame"): "Nächstes unsicheres Bild",
    ("Operator", "Next Unsure Camera Frame"): "Nächstes unsicheres Bild der Kamera",
    (
        "*",
        "Go to a frame that tracking of the camera is not sure of",
    ): "Zu einem Bild gehen, das beim Verfolgen der Kamera unsicher ist",
    ("*", "Go to a frame that tracking is not sure of"): "Zu einem Bild gehen, das beim Verfolgen unsicher ist",
    ("*", "Frame"): "Bild",
    (
        "*",
        "Timeline frame; without one, the worst of the next that are unsure",
    ): "Bild der Zeitleiste; ohne eines das schlechteste der nächsten unsicheren",
    (
        "*",
        "No other stretch of unsure frames lies ahead",
    ): "Es folgt keine weitere Strecke unsicherer Bilder",
    (
        "*",
        "the current frame is outside of the Shutter strip",
    ): "das aktuelle Bild liegt außerhalb des Verschlussstreifens",
    (
        "*",
        '{place}: the F-curve of "{channel}" is locked',
    ): "{place}: die F-Kurve von „{channel}“ ist gesperrt",
    (
        "*",
        '{place}: the F-curve of "{channel}" is muted',
    ): "{place}: die F-Kurve von „{channel}“ ist stummgeschaltet",
    ("*", "the shot ends here"): "die Einstellung endet hier",
    (
        "*",
        "the subject is covered, or looks too different",
    ): "das Motiv ist verdeckt oder sieht zu anders aus",
    ("*", "the subject has left the picture"): "das Motiv hat das Bild verlassen",
    ("*", "there are too few corners to follow"): "es gibt zu wenige Ecken, denen zu folgen wäre",
    ("*", "the region has no strokes to follow"): "die Region hat keine Striche, denen zu folgen wäre",
    ("*", "the region lies outside the picture"): "die Region liegt außerhalb des Bildes",
    ("*", "there is no other frame to track"): "es gibt kein anderes Bild zum Verfolgen",
    ("*", "the frame lies outside what can be tracked"): "das Bild liegt außerhalb dessen, was verfolgt werden kann",
    (
        "*",
        "what the regions leave of the picture has too few corners to follow",
    ): "was die Regionen vom Bild übrig lassen, hat zu wenige Ecken, denen zu folgen wäre",
    ("*", "the picture is too unlike those before"): "das Bild ist denen davor zu unähnlich",
    (
        "*",
        "the picture is too unlike those before, and it goes on from here",
    ): "das Bild ist denen davor zu unähnlich, und von hier aus geht es weiter",
    ("*", "Not tracked: from frame {first} on"): "Nicht verfolgt: ab Bild {first}",
    ("*", "Not tracked: up to frame {last}"): "Nicht verfolgt: bis Bild {last}",
    ("*", "Not tracked: frames {first} to {last}"): "Nicht verfolgt: Bilder {first} bis {last}",
    ("*", "Fade Out When Lost"): "Ausblenden, wenn verloren",
    (
        "*",
        "Track keys a region's opacity, or the camera's influence, so that it fades where the track ends; "
        "a region ends with its shot",
    ): "Verfolgen gibt der Deckkraft einer Region, oder dem Einfluss der Kamera, Schlüsselbilder: Sie klingt aus, "
    "wo die Verfolgung endet; eine Region endet mit ihrer Einstellung",
    ("*", "What of its motion is followed"): "Was von der Bewegung gilt",
    ("*", "Smoothness"): "Glätte",
    (
        "*",
        "Frames before and after each over which the motion is averaged, as the mass of a camera does: "
        "at 0 it is followed as it is",
    ): "Bilder vor und nach jedem, über die die Bewegung gemittelt wird, wie es die Masse einer Kamera tut: "
    "Bei 0 gilt sie, wie sie ist",
    ("*", "Influence"): "Einfluss",
    (
        "*",
        "How much is left of exposures that follow the camera: at 0 the shown frame alone",
    ): "Wie viel von Belichtungen bleibt, die der Kamera folgen: bei 0 das gezeigte Bild allein",
    ("Operator", "Track Camera"): "Kamera verfolgen",
    (
        "*",
        "Key the camera by what the regions leave free, up to your own keys (Esc stops and keeps the tracked frames)",
    ): "Der Kamera Schlüsselbilder nach allem geben, was die Regionen frei lassen, bis zu eigenen Schlüsselbildern "
    "(Esc hält an und behält die verfolgten Bilder)",
    ("Operator", "Stabilize Exposure"): "Belichtung stabilisieren",
    (
        "*",
        "Expose for long as if the camera had stood still (tracks the camera unless it has keys)",
    ): "Lange belichten, als hätte die Kamera still gestanden (verfolgt sie, wenn sie keine Schlüsselbilder hat)",
    ("Operator", "Follow Stabilization"): "Der Stabilisierung folgen",
    (
        "*",
        "Key the camera by the 2D stabilization of a movie clip, from where the camera is at this frame",
    ): "Der Kamera Schlüsselbilder nach der 2D-Stabilisierung eines Filmclips geben, von ihrem Ort in diesem Bild aus",
    ("*", 'clip "{clip}" has no 2D stabilization'): "Clip „{clip}“ hat keine 2D-Stabilisierung",
    ("*", 'camera of effect "{name}"'): "Kamera des Effekts „{name}“",
    ("*", "How what the camera sees moves"): "Wie sich bewegt, was die Kamera sieht",
    ("*", "Name of the camera's animation channels"): "Name der Animationskanäle der Kamera",
    ("Operator", "Panning Shot"): "Mitzieher",
    (
        "*",
        "Keep the active region sharp while all else streaks past it (tracks the region unless it has keys)",
    ): "Die aktive Region scharf halten, während alles andere an ihr vorbei verwischt "
    "(verfolgt die Region, falls sie keine Schlüsselbilder hat)",
    ("Operator", "Sharp Subject"): "Scharfes Motiv",
    (
        "*",
        "Keep the active region sharp before all else, which is exposed for long and without it",
    ): "Die aktive Region scharf vor alles andere stellen, das lange und ohne sie belichtet wird",
    ("Operator", "Trail"): "Bewegungsspur",
    (
        "*",
        "Have the active region leave a trail before all else, which stays sharp",
    ): "Die aktive Region eine Spur ziehen lassen, vor allem anderen, das scharf bleibt",
    ("*", "Subject"): "Motiv",
    ("Virtual Shutter", "Holes"): "Löcher",
    (
        "*",
        "The result, and where no exposed frame shows what lies behind layers: orange is taken from another frame, "
        "purple is filled from what is around",
    ): "Das Ergebnis, und wo kein belichteter Frame zeigt, was hinter Ebenen liegt: Orange stammt aus einem anderen "
    "Frame, Violett ist aus der Umgebung gefüllt",
    ("*", "Behind: another frame"): "Dahinter: ein anderer Frame",
    ("*", "Behind: filled"): "Dahinter: gefüllt",
    ("*", "Nothing"): "Nichts",
    ("*", "Camera"): "Kamera",
    ("*", "What the exposure moves with"): "Womit sich die Belichtung mitbewegt",
    (
        "*",
        "The exposure stays where it is in the picture",
    ): "Die Belichtung bleibt, wo sie im Bild ist",
    (
        "*",
        "The exposure moves with a region: what the region moves with stays sharp",
    ): "Die Belichtung bewegt sich mit einer Region: Was sich mit der Region bewegt, bleibt scharf",
    (
        "*",
        "The exposure moves with what the camera sees, as if the camera had stood still",
    ): "Die Belichtung bewegt sich mit dem, was die Kamera sieht, als hätte die Kamera still gestanden",
    ("*", "Moved With"): "Bewegt mit",
    (
        "*",
        "Name of the region that the exposure moves with",
    ): "Name der Region, mit der sich die Belichtung bewegt",
    ("Virtual Shutter", "Exposure Length"): "Belichtungslänge",
    ("Virtual Shutter", "Timeline"): "Zeitleiste",
    ("Virtual Shutter", "Distance"): "Strecke",
    (
        "*",
        "The bars are the exposure of one frame of the timeline, however fast the footage runs",
    ): "Die Balken sind die Belichtung eines Bildes der Zeitleiste, wie schnell das Material auch läuft",
    ("*", "What says how long the exposure is"): "Was sagt, wie lang die Belichtung ist",
    (
        "*",
        "The bars say for how many frames the shutter is open",
    ): "Die Balken sagen, wie viele Bilder lang der Verschluss offen ist",
    (
        "*",
        "The shutter is open while what it follows moves by a set distance; the bars are the shape",
    ): "Der Verschluss ist offen, während sich das, womit er sich mitbewegt, um eine gegebene Strecke bewegt; "
    "die Balken sind die Form",
    ("*", "Distance"): "Strecke",
    (
        "*",
        "How far what is followed moves while the shutter is open, as a fraction of the picture's height",
    ): "Wie weit sich bei offenem Verschluss bewegt, was verfolgt wird, als Bruchteil der Bildhöhe",
    (
        "*",
        "Where what the camera sees has moved to, as a fraction of the picture",
    ): "Wohin sich bewegt hat, was die Kamera sieht, als Bruchteil des Bildes",
    (
        "*",
        "Rotation of what the camera sees, about the picture's center",
    ): "Drehung dessen, was die Kamera sieht, um die Bildmitte",
    (
        "*",
        "Scale of what the camera sees, about the picture's center",
    ): "Skalierung dessen, was die Kamera sieht, um die Bildmitte",
    (
        "*",
        '{place}: there is no region "{region}" to follow',
    ): "{place}: Es gibt keine Region „{region}“, der zu folgen wäre",
    ("*", "Exposure Moves With"): "Belichtung bewegt sich mit",
    ("*", "Follow Track"): "Einer Spur folgen",
    ("Operator", "Follow Track"): "Einer Spur folgen",
    (
        "*",
        "Key the active region by a track of a movie clip, from where the region is at this frame",
    ): "Der aktiven Region Schlüsselbilder nach einer Spur eines Filmclips geben, von ihrem Ort in diesem Bild aus",
    ("Operator", "Update"): "Aktualisieren",
    ("Operator", "Update Followed Track"): "Gefolgte Spur aktualisieren",
    (
        "*",
        "Key the active region anew by what it follows, after the track has changed",
    ): "Der aktiven Region neue Schlüsselbilder nach dem geben, dem sie folgt, nachdem die Spur sich geändert hat",
    ("*", "What the region follows"): "Was die Region verfolgt",
    ("*", "Track"): "Spur",
    (
        "*",
        "A single track, which moves the region and does not turn it",
    ): "Eine einzelne Spur, die die Region bewegt und nicht dreht",
    ("*", "Plane Track"): "Flächenspur",
    ("*", "The corners of a plane track"): "Die Ecken einer Flächenspur",
    ("*", "Object"): "Objekt",
    ("*", "All tracks of an object, or of the camera"): "Alle Spuren eines Objekts oder der Kamera",
    ("*", "Clip"): "Clip",
    (
        "*",
        "Movie clip of the source's footage, in which something is tracked",
    ): "Filmclip vom Material der Quelle, in dem etwas verfolgt ist",
    (
        "*",
        "Tracking object that has the tracks; without one, the camera",
    ): "Verfolgungsobjekt mit den Spuren; ohne eines die Kamera",
    (
        "*",
        "Name of the track or plane track that is followed",
    ): "Name der Spur oder Flächenspur, der gefolgt wird",
    ("*", "Follow From"): "Folgen ab",
    ("*", "The track has changed"): "Die Spur hat sich geändert",
    ("*", "Choose a clip first"): "Zuerst einen Clip wählen",
    ("*", "The region does not follow a track"): "Die Region folgt noch keiner Spur",
    ("*", 'clip "{clip}" has no track "{track}"'): "Clip „{clip}“ hat keine Spur „{track}“",
    (
        "*",
        'clip "{clip}" does not begin with the same file as strip "{strip}"',
    ): "Clip „{clip}“ beginnt nicht mit derselben Datei wie Streifen „{strip}“",
    (
        "*",
        "Until is frame {frame}, which does not lie in that direction; 0 is the end of the strip",
    ): "Bis ist Bild {frame}, das nicht in dieser Richtung liegt; 0 ist das Ende des Streifens",
    (
        "*",
        '"{track}" of clip "{clip}" has no marker at frame {frame}',
    ): "„{track}“ von Clip „{clip}“ hat keinen Marker bei Bild {frame}",
    ("*", 'region "{name}" has no strokes'): "Region „{name}“ hat keine Striche",
    # Recipes
    ("Operator", "Choose Source"): "Quelle wählen",
    ("*", "Choose Source"): "Quelle wählen",
    ("*", "Source: {strip}"): "Quelle: {strip}",
    (
        "*",
        "Give the effect another clip: the movie, image or clip strip whose frames it exposes",
    ): "Dem Effekt einen anderen Clip geben: den Film-, Bild- oder Clip-Strip, dessen Einzelbilder er belichtet",
    ("Operator", "Copy Effect"): "Effekt kopieren",
    (
        "*",
        "Copy the shutters, regions, keyframes and options of the effect, for other strips and scenes of this file",
    ): "Verschlüsse, Regionen, Keyframes und Optionen des Effekts für andere Strips und Szenen dieser Datei kopieren",
    (
        "*",
        "Copied, without what a newer version of Virtual Shutter has added",
    ): "Kopiert, ohne das, was eine neuere Version von Virtual Shutter hinzugefügt hat",
    ("Operator", "Paste Effect"): "Effekt einfügen",
    (
        "*",
        "Give the active strip the copied effect; where it has one, that is replaced",
    ): "Dem aktiven Strip den kopierten Effekt geben; hat er schon einen, wird der ersetzt",
    ("*", "Copy an effect first"): "Zuerst einen Effekt kopieren",
    ("Operator", "Import Recipe"): "Rezept importieren",
    (
        "*",
        "Replace the shutters, regions, keyframes and options of the effect with those of a recipe file",
    ): "Verschlüsse, Regionen, Schlüsselbilder und Optionen des Effekts durch die einer Rezeptdatei ersetzen",
    (
        "*",
        "frame {frame} of the recipe: a key cannot lie beyond Blender's timeline",
    ): "Bild {frame} des Rezepts: ein Schlüsselbild kann nicht außerhalb von Blenders Zeitleiste liegen",
    (
        "*",
        "frame {frame} of the recipe: so late on the timeline, the next key is on the same frame",
    ): "Bild {frame} des Rezepts: so spät auf der Zeitleiste liegt das nächste Schlüsselbild auf demselben Bild",
    ("Operator", "Export Recipe"): "Rezept exportieren",
    (
        "*",
        "Save the shutters, regions, keyframes and options of the effect as a recipe file",
    ): "Verschlüsse, Regionen, Schlüsselbilder und Optionen des Effekts als Rezeptdatei speichern",
    ("*", "Choose a file"): "Eine Datei wählen",
    ("*", 'Saved "{path}"'): "„{path}“ gespeichert",
    # Source time
    ("*", "Custom Time"): "Eigene Zeit",
    (
        "*",
        "Show the source at the time that is set here, in place of the strip's own timing",
    ): "Die Quelle zu der Zeit zeigen, die hier eingestellt ist, anstelle der Zeit des Streifens",
    ("*", "Source Time"): "Quellzeit",
    (
        "*",
        "Source frame that is shown, 1 is the source's first; keyed, it is a speed ramp",
    ): "Bild der Quelle, das gezeigt wird, 1 ist ihr erstes; mit Schlüsselbildern eine Geschwindigkeitsrampe",
    # Bake
    ("*", "Bake"): "Backen",
    ("*", "{strip} Baked"): "{strip} gebacken",
    ("Operator", "Bake to Strip"): "Zu Strip backen",
    ("Operator", "Bake Again"): "Neu backen",
    ("Operator", "Stop Baking"): "Backen anhalten",
    ("Operator", "Unbake"): "Backen aufheben",
    (
        "*",
        "Render the effect beside Blender, and put the film above it as a strip. Frames that are finished are kept",
    ): "Den Effekt neben Blender rendern und den Film als Strip darüberlegen. Fertige Bilder bleiben erhalten",
    (
        "*",
        "Stop the bake that runs. Frames that are finished stay, and the next bake goes on from there",
    ): "Das laufende Backen anhalten. Fertige Bilder bleiben, und das nächste Backen macht dort weiter",
    (
        "*",
        "Remove the baked strip, and show the effect again. The baked files stay",
    ): "Den gebackenen Strip entfernen und den Effekt wieder zeigen. Die gebackenen Dateien bleiben",
    (
        "*",
        "H.264, for playing: levels are off by little, and there is no transparency",
    ): "H.264, zum Abspielen: Werte weichen um wenig ab, und es gibt keine Transparenz",
    (
        "*",
        "A folder of pictures in full precision, which play more slowly",
    ): "Ein Ordner von Bildern in voller Genauigkeit, die langsamer abspielen",
    ("*", "Movie"): "Film",
    ("*", "An effect is being baked"): "Ein Effekt wird gerade gebacken",
    ("*", "No effect is being baked"): "Es wird kein Effekt gebacken",
    ("*", "The effect is not baked"): "Der Effekt ist nicht gebacken",
    ("*", "The effect is baked: unbake it to see changes"): "Der Effekt ist gebacken: Backen aufheben, um Änderungen"
    " zu sehen",
    ("*", "The baked strip was deleted"): "Der gebackene Strip wurde gelöscht",
    ("*", "The effect has changed since it was baked"): "Der Effekt hat sich geändert, seit er gebacken wurde",
    ("*", "Baked, and up to date"): "Gebacken und aktuell",
    (
        "*",
        "baked frames lie beside the .blend file: save it first",
    ): "gebackene Bilder liegen neben der .blend-Datei: zuerst speichern",
    (
        "*",
        '"{strip}" is retimed, strobed or reversed itself: do that to its source',
    ): "„{strip}“ ist selbst umgezeitet, stroboskopiert oder umgekehrt: das gehört an die Quelle",
    (
        "*",
        '"{strip}" is the input of another strip, which would not show the baked one',
    ): "„{strip}“ ist die Eingabe eines anderen Strips, der den gebackenen nicht zeigen würde",
    (
        "*",
        'above "{strip}" there is no channel with room for the baked strip',
    ): "über „{strip}“ ist kein Kanal mit Platz für den gebackenen Strip",
    ("*", "a movie has no light above white: bake to OpenEXR"): "ein Film hat kein Licht über Weiß: zu OpenEXR backen",
    (
        "*",
        "the Python package {package} is missing, which movies need: bake to OpenEXR",
    ): "das Python-Paket {package} fehlt, das Filme brauchen: zu OpenEXR backen",
    (
        "*",
        "movies are baked in Blender's own colours: with another configuration, bake to OpenEXR",
    ): "Filme haben Blenders eigene Farben: mit einer anderen Konfiguration zu OpenEXR backen",
    ("*", "a movie has no transparency: bake to OpenEXR"): "ein Film hat keine Transparenz: zu OpenEXR backen",
    ("*", "the bake ended without a word"): "das Backen endete ohne ein Wort",
    ("*", "the bake cannot begin: {reason}"): "das Backen kann nicht beginnen: {reason}",
    (
        "*",
        'the strip that was baked is gone; its film is "{path}"',
    ): "der Strip, der gebacken wurde, ist nicht mehr da; sein Film ist „{path}“",
    # Reports
    ("Operator", "Copy Report"): "Bericht kopieren",
    ("*", "Report"): "Bericht",
    (
        "*",
        "Copy versions, device, kinds and numbers of the edit, and last errors: no names, no paths. Nothing is sent",
    ): "Versionen, Gerät, Arten und Zahlen des Schnitts und die letzten Fehler kopieren: keine Namen, keine Pfade. "
    "Nichts wird gesendet",
    ("*", "Report copied: paste it into your message, and read it before you send it"): "Bericht kopiert: "
    "in die Nachricht einfügen, und vor dem Senden lesen",
    ("*", "Without a window there is no clipboard: use the command check with --report"): "Ohne Fenster gibt es keine "
    "Zwischenablage: der Befehl check mit --report gibt den Bericht aus",
    # Devices
    ("Virtual Shutter", "Render Device"): "Rendergerät",
    (
        "*",
        "What composes renders; the preview is always composed on the GPU that Blender draws with",
    ): "Was Renderbilder berechnet; die Vorschau berechnet immer die GPU, mit der Blender zeichnet",
    ("Virtual Shutter", "Automatic"): "Automatisch",
    (
        "*",
        "OpenGL 4.3 where there is one, else Blender's own GPU, else NumPy",
    ): "OpenGL 4.3, wo es das gibt, sonst Blenders eigene GPU, sonst NumPy",
    ("Virtual Shutter", "GPU"): "GPU",
    ("*", "As Automatic, but never NumPy"): "Wie Automatisch, aber nie NumPy",
    ("Virtual Shutter", "OpenGL 4.3"): "OpenGL 4.3",
    ("*", "An OpenGL context of its own, beside Blender's"): "Ein eigener OpenGL-Kontext neben dem von Blender",
    ("Virtual Shutter", "Blender's GPU"): "Blenders GPU",
    ("*", "The GPU that Blender draws with"): "Die GPU, mit der Blender zeichnet",
    ("Virtual Shutter", "NumPy"): "NumPy",
    ("*", "The processor, which is slow"): "Der Prozessor, was langsam ist",
    ("Virtual Shutter", "GPU Memory"): "GPU-Speicher",
    (
        "*",
        "Megabytes of the GPU's memory that frames and pictures may take, from the next render on. 0: three quarters of"
        " what there is, and half of the machine's memory at most",
    ): "Megabyte des GPU-Speichers, die Einzelbilder und Ergebnisse belegen dürfen, ab dem nächsten Rendern. 0: drei"
    " Viertel des vorhandenen und höchstens die Hälfte des Arbeitsspeichers",
}
