"""The user interface in Blender's sequencer: operators, panels, menus, live preview, gizmos, translations."""
