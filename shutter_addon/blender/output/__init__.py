"""Write films, mattes and error reports, and check beforehand whether an edit can be rendered."""
