"""What becomes of a file of an older format as it is loaded."""

from collections.abc import Callable

from ..data import data_format

# By the format that each leads to, in order; the first version's was 1. They are run as a file is loaded of which
# anything is older, and may find newer scenes beside: what needs no change is left as it is.
MIGRATIONS: tuple[tuple[int, Callable[[], None]], ...] = ()


def migrate() -> None:
    """Brings the file that was loaded to the format of this version."""
    stored = data_format.of_file()
    for number, change in MIGRATIONS:
        if stored < number:
            change()
    data_format.stamp_migrated()  # and not as it is saved: autosave tells nobody
