"""How far a long work is: a bar on a terminal, elsewhere nothing."""


def progress(steps=None, total=None, desc=None, **options):
    """Return what iterates over steps and shows how far it is, see `tqdm`; no bar stays behind."""
    from tqdm import tqdm  # late: most commands show none

    return tqdm(steps, total=total, desc=desc, leave=False, disable=None, **options)
