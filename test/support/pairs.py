"""Clouds and guesses as plain records."""

import itertools
from types import SimpleNamespace as Record

import numpy as np
from poses import SECOND, header
from poses import transform as guess_message

from idem_ros.messages.pointcloud2 import pack_points

POINTS = np.arange(1.0, 31.0).reshape(10, 3)
NUMBERS = itertools.count()
LONG_AGO = 100 * SECOND
LATER = LONG_AGO + 20 * SECOND


def cloud(stamp, frame='', points=None):
    """A cloud like no other, unless its points are given."""
    packed = pack_points(POINTS + next(NUMBERS) if points is None else points)
    fields = [Record(name=n, offset=o, datatype=d, count=c) for n, o, d, c in packed.fields]
    return Record(**{**vars(packed), 'fields': fields, 'header': header(stamp, frame)})


def guess(stamp, frame='', child=''):
    """A guess whose x tells its stamp [ns]."""
    return guess_message(stamp, float(stamp), frame, child)


def x_of(pair):
    return pair.guess.T_target_source[0, 3]
