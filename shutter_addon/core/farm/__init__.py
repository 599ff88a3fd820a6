"""How machines render one film together: claims, chunks, and versions of an edit. Uses no other room."""
