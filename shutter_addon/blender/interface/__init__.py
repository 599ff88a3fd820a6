"""What users see and click: operators, panels, preview, gizmos, languages."""
