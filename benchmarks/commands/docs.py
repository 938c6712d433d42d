"""`make docs`: write the parts of the documents that follow from the code, and the picture."""

from pathlib import Path

from idem_ros.terminal.command_line import FAILED, OK, UsageError

PICTURE = 'docs/refinement.png'
BAG = 'bags/demo.mcap'
FRAME = 12
VOXEL_SIZE = 0.5


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'docs',
        help='write the tables and the picture of the documents again',
        description='Write the tables of topics, parameters and figures into the README of this '
        'checkout and the documents beside it, '
        f'and {PICTURE} (needs matplotlib).',
    )
    parser.add_argument('--readme', metavar='FILE', default='README.md')
    parser.add_argument(
        '--check', action='store_true', help='write nothing; exit 1 if the tables are out of date'
    )
    parser.set_defaults(run=run)


def run(args):
    """Write or check the blocks of the documents."""
    from benchmarks.documentation import documents
    from idem_ros.files.atomic_file import replacing

    readme = Path(args.readme)
    if not readme.is_file():
        raise UsageError(f'{readme} does not exist; run this in the checkout, or name the file')
    written = documents(readme)
    stale = [path for path, text in written.items() if path.read_text() != text]
    if args.check:
        names = ', '.join(path.name for path in stale)
        print(f'out of date: {names}; run make docs' if stale else 'the documents are up to date')
        return FAILED if stale else OK
    for path in stale:
        with replacing(path) as temporary:
            Path(temporary).write_text(written[path])
    _draw(readme.parent)
    return OK


def _draw(folder):
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise UsageError('the picture needs matplotlib: pip install ".[plot]"') from error
    from benchmarks.refinement_picture import draw_frame
    from idem_ros.core import RegistrationConfig

    config = RegistrationConfig(voxel_size=VOXEL_SIZE)
    draw_frame(folder / BAG, FRAME, folder / PICTURE, config)
