"""What a result may hold: types and ranges of all that is read back from its JSON."""

import json
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from idem_ros.core.arrays import LARGEST
from idem_ros.core.config import VOXEL_SIZES
from idem_ros.core.exceptions import InvalidTransform
from idem_ros.core.geometry.se3 import checked_transform

LAST_STAMP = 2**32 * 10**9  # [ns]
MOST_OF_PATH = 4096  # letters, as Linux has it
SHOWN = 60  # letters of what was given
KEPT_AS_GIVEN = ConfigDict(strict=True, extra='allow', allow_inf_nan=False)


def _small(value):
    """Refuse numbers that overflow when they are squared, as deep as they may be."""
    if isinstance(value, list | dict):
        for each in value.values() if isinstance(value, dict) else value:
            _small(each)
    elif isinstance(value, int | float) and abs(value) > LARGEST:
        raise ValueError(f'it holds {value:.3g}, which nothing measures')
    return value


def _rigid(matrix):
    try:
        checked_transform(matrix, 'it')
    except InvalidTransform as error:
        raise ValueError(str(error)) from error
    return matrix


def _plain(name):
    if '/' in name or name in ('', '.', '..'):
        raise ValueError('it must be a name without folders')
    return name


def _path(text):
    if '\0' in text:
        raise ValueError('it holds a zero byte, which no path does')
    return text


Known: TypeAlias = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Number: TypeAlias = Known | None
"""None: unknown."""
Size: TypeAlias = Annotated[float, Field(ge=0, le=LARGEST)] | None
Count: TypeAlias = Annotated[int, Field(ge=0, le=2**53)]
Stamp: TypeAlias = Annotated[int, Field(ge=-LAST_STAMP // 2, le=LAST_STAMP)]
Anything: TypeAlias = Annotated[Any, AfterValidator(_small)]
Path: TypeAlias = Annotated[str, Field(max_length=MOST_OF_PATH), AfterValidator(_path)]
Row: TypeAlias = Annotated[list[Known], Field(min_length=4, max_length=4)]
Transform: TypeAlias = Annotated[
    list[Row], Field(min_length=4, max_length=4), AfterValidator(_rigid)
]
SixNumbers: TypeAlias = Annotated[list[Number], Field(min_length=6, max_length=6)]
Covariance: TypeAlias = Annotated[list[SixNumbers], Field(min_length=6, max_length=6)]


class _Record(BaseModel):
    """What a record says beyond its fields is kept; what it does not say is unknown."""

    model_config = KEPT_AS_GIVEN
    __pydantic_extra__: dict[str, Anything]


class Frame(_Record):
    """One refined source, see `summary.json_record`."""

    stamp_ns: Stamp
    stamp: Number = None
    target_frame: str = ''
    source_frame: str = ''
    T_target_source: Transform = None
    T_guess: Transform = None
    status: str = ''
    verdict: str = ''
    verdict_reason: str = ''
    free_motions: str = ''
    iterations: Size = None
    q_tot: Number = None
    q_tot_before: Number = None
    q_mean: Number = None
    overlap: Annotated[float, Field(ge=0, le=1)] | None = None
    overlap_source: Annotated[float, Field(ge=0, le=1)] | None = None
    overlap_target: Annotated[float, Field(ge=0, le=1)] | None = None
    p_aligned: Annotated[float, Field(ge=0, le=1)] | None = None
    radius: Size = None
    voxel_size: Annotated[float, Field(ge=VOXEL_SIZES[0], le=VOXEL_SIZES[1])] | None = None
    basin: Size = None
    swap_gap: Number = None
    time_ms: Number = None
    points_target: Count = 0
    points_source: Count = 0
    dropped_nonfinite: Count = 0
    dropped_zero: Count = 0
    dropped_stray: Count = 0
    cropped: Count = 0
    thinned: Count = 0
    covariance: Covariance = None
    twist: SixNumbers = None
    twist_covariance: Covariance = None
    moved: Size = None
    reference: Number = None
    motion_flaw: str = ''
    point_times: str = ''
    translation_error_m: Size = None
    translation_error_m_before: Size = None
    rotation_error_deg: Size = None
    rotation_error_deg_before: Size = None


class Summary(_Record):
    """How many sources became what."""

    frames: Count
    refused: Count
    dropped: Count
    unpaired: Count
    interrupted: bool = False
    files_missing: Count = 0
    files_unreadable: Count = 0
    files_damaged: Count = 0
    files_extra: Count = 0
    chunks_left_out: Count = 0
    messages_left_out: Count = 0


class Input(_Record):
    """The recording, or the map from a file, see `fingerprint`."""

    name: Annotated[Path, AfterValidator(_plain)] = 'unknown'
    size: Count = 0
    sha256: str = ''


class MadeBy(_Record):
    """How a result was made, see `provenance.made_by`."""

    versions: dict[str, str | None] = {}
    input: Input = None
    map: Input = None
    topics: dict[str, str | list[str] | None] = {}
    parameters: dict[str, Number | bool | str | list[Number | str]] = {}


class Sequence(_Record):
    """What odometry knows beside its frames, see `frames.Sequence`."""

    map: str
    first_stamp: Stamp
    errors: dict[str, Any] | None = None


class Record(_Record):
    """All of a result."""

    bag: Path = ''
    method: str = ''
    made_by: MadeBy = None
    frames: list[Frame]
    summary: Summary
    notes: list[str] = []
    sequence: Sequence = None


def what_is_wrong(record):
    """Return in one line where a record departs from the schema, and how; empty: nowhere."""
    try:
        Record.model_validate(record)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = '.'.join(map(str, first['loc']))[:SHOWN] or 'it'
        if first['type'] == 'missing':
            return f'{place} is missing'
        why = first['msg'].removeprefix('Value error, ').replace(f'{LARGEST:.0f}', f'{LARGEST:g}')
        return f'{place} is {_shown(first["input"])}: {why[:1].lower()}{why[1:]}'
    return ''


def _shown(value):
    kinds = {list: 'a list', dict: 'a record'}
    return kinds.get(type(value)) or json.dumps(value)[:SHOWN]
