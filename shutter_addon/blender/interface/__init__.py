"""The user interface: operators, panels, preview, gizmos, translations."""
