"""`idem map`: maps on disk, made ready for those who look for scans in them."""

from idem_ros.commands.inputs import add_columns_option
from idem_ros.terminal.command_line import OK, UsageError, progress

SIZE = 100  # [m]


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'map', help='cut a map into tiles', description='Make maps ready for --target-file.'
    )
    kinds = parser.add_subparsers(title='commands', metavar='COMMAND')
    tile = kinds.add_parser(
        'tile',
        help='cut a map into tiles',
        description="Cut a map into square tiles, as .pcd with the metadata that Autoware's map "
        'loader reads. However large the map, a part of it is in memory at a time. Tiles are in '
        'float32 where that loses less than half a millimetre, else in float64, which Autoware '
        'does not read: subtract an offset before.',
    )
    tile.add_argument('map', metavar='MAP', help='a cloud, a folder of clouds, or of tiles')
    tile.add_argument(
        '--size',
        metavar='M',
        type=int,
        default=SIZE,
        help='edge of a tile, whole metres (default: %(default)s)',
    )
    tile.add_argument('--out', metavar='FOLDER', required=True, help='new folder to write')
    add_columns_option(tile)
    tile.set_defaults(run=_tile)


def _tile(args):
    from idem_ros.maps.tile_writer import cut_map

    if args.size < 1:
        raise UsageError(f'--size is {args.size}; it must be a whole number of metres from 1')
    with progress(unit=' points', unit_scale=True) as bar:
        cut = cut_map(args.map, args.out, args.size, args.columns, bar.update)
    line = f'{args.out}: {cut.tiles} tiles of {args.size} x {args.size} m, {cut.points} points'
    line += f'; {cut.left_out} far from all the rest left out' if cut.left_out else ''
    print(line + ('; in float64, which Autoware does not read' if cut.is_float64 else ''))
    return OK
