"""`idem docs`: write the parts of the README that follow from the code, and its picture."""

from pathlib import Path

from idem_ros.commands.exit_codes import FAILED, OK, UsageError

PICTURE = 'docs/refinement.png'
BAG = 'bags/demo.mcap'
FRAME = 12
VOXEL_SIZE = 0.5


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'docs',
        help='write the tables and the picture of the README again',
        description='Write the tables of topics and parameters into the README of this checkout, '
        f'and {PICTURE} (needs matplotlib).',
    )
    parser.add_argument('--readme', metavar='FILE', default='README.md')
    parser.add_argument(
        '--check', action='store_true', help='write nothing; exit 1 if the tables are out of date'
    )
    parser.set_defaults(run=run)


def run(args):
    """Write or check the README's blocks."""
    from idem_ros.atomic_file import replacing
    from idem_ros.documentation import blocks, with_blocks

    readme = Path(args.readme)
    if not readme.is_file():
        raise UsageError(f'{readme} does not exist; run this in the checkout, or name the file')
    text = readme.read_text()
    written = with_blocks(text, blocks(readme.parent))
    if args.check:
        print(f'{readme} is {"up to date" if written == text else "out of date: run make docs"}')
        return OK if written == text else FAILED
    with replacing(readme) as temporary:
        Path(temporary).write_text(written)
    _draw(readme.parent)
    return OK


def _draw(folder):
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise UsageError('the picture needs matplotlib: pip install ".[plot]"') from error
    from idem_ros.core import RegistrationConfig
    from idem_ros.evaluation.picture import draw_frame

    config = RegistrationConfig(voxel_size=VOXEL_SIZE)
    draw_frame(folder / BAG, FRAME, folder / PICTURE, config)
