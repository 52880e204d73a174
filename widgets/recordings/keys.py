"""The keys of the Recordings workspace, as F1 lists them."""

SHORTCUTS = (
    ("Move the cursor; by 1 ms", "Left and Right; with Shift"),
    ("Cursor to the beginning, to the end", "Home, End"),
    ("Scroll", "Page Up, Page Down, Shift and wheel"),
    ("Zoom in, out; show all", "+, −, wheel; 0"),
    ("Select a stretch", "Shift and drag, or [ and ]"),
    ("Select nothing", "Backspace"),
    ("Previous step, next step", ", and ."),
    ("Mark; mark with a text; remove the nearest mark", "M; Shift+M; Shift+Backspace"),
    ("Leave the chosen steps out of means, or take them in again", "X"),
    ("Body weight of the person, or of all", "W"),
    ("Play the stretch, or stop", "P or Space"),
    ("Loop", "L"),
    ("Rename, delete the recording", "F2, Delete in the list"),
    ("Compare recordings; back", "Ctrl or Shift and click in the list; Escape"),
    ("Export the recording", "Ctrl+Shift+E"),
)
