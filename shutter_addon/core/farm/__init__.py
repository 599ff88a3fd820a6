"""How machines render one film together: claims, and versions of an edit. Uses no other room."""
