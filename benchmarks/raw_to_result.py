"""From raw points to a result, in one call as users make it, and in parts."""

from dataclasses import replace
from functools import partial

from benchmarks.case import errors, succeeded
from benchmarks.methods import PEERS, Setting
from idem_ros.core import Cloud, register
from idem_ros.replay.peers import CRITERIA, NEIGHBOURS, small_gicp

DISTANCES, RESOLUTIONS = (1.0, 3.0, 10.0), (1.5, 3.0)  # in spacings
LOOSE = 2e-3  # spacings: the translation criterion; small_gicp's own 1 mm where r4th is 0.5 m


def peer_settings():
    """Return the settings among which each peer's fastest that succeeds is found."""
    return [Setting(method, d) for method in PEERS[:3] for d in DISTANCES] + [
        Setting('VGICP', 10.0, edge) for edge in RESOLUTIONS
    ]


def idem_from_raw(case, config, threads=1):
    """Return run(T_guess) -> T_target_source, of IDEM from raw points."""
    config = replace(config, voxel_size=case.voxel_size, threads=threads)

    def run(T_guess):
        return register(case.target, case.source, T_guess, config).T_target_source

    return run


def peer_from_raw(case, setting, threads=1, tight=False):
    """Return run(T_guess) -> T_target_source, of one of small_gicp's methods from raw points.

    It stops at small_gicp's own criteria, the translation in proportion to the spacing (on an
    object in metres it would else be as coarse as the start), or at the `tight` ones of IDEM.
    """
    gicp = small_gicp()
    options = {
        'registration_type': setting.method,
        'downsampling_resolution': case.voxel_size,
        'max_correspondence_distance': setting.distance * case.spacing,
        'num_threads': threads,
        **(CRITERIA if tight else {}),
        'translation_epsilon': case.spacing
        * (CRITERIA['translation_epsilon'] if tight else LOOSE),
    }
    if setting.resolution is not None:
        options['voxel_resolution'] = setting.resolution * case.spacing

    def run(T_guess):
        return gicp.align(case.target, case.source, T_guess, **options).T_target_source

    return run


def idem_to_prepared(case, config):
    """Return run(T_guess) as of `idem_from_raw`, with a target prepared by an earlier call."""
    target = Cloud(case.target)
    config = replace(config, voxel_size=case.voxel_size)
    register(target, case.source, case.truth, config)

    def run(T_guess):
        return register(target, case.source, T_guess, config).T_target_source

    return run


def idem_parts(case, config):
    """Return name -> run(T_guess) of what IDEM does from raw points.

    What `register` prepares cannot be called alone: it is the whole less the other two.
    """
    clouds = [Cloud(points) for points in (case.target, case.source)]
    config = replace(config, voxel_size=case.voxel_size)
    register(*clouds, case.truth, config)
    return {
        'downsampling': lambda _: [
            Cloud(points).reduced(case.voxel_size) for points in (case.target, case.source)
        ],
        'solve': lambda T_guess: register(*clouds, T_guess, config),
    }


def gicp_parts(case, setting):
    """Return name -> run(T_guess) of what small_gicp's GICP does from raw points."""
    gicp = small_gicp()
    reduce = partial(gicp.voxelgrid_sampling, downsampling_resolution=case.voxel_size)
    clouds = [reduce(points) for points in (case.target, case.source)]

    def prepare(_):
        trees = [gicp.KdTree(cloud) for cloud in clouds]
        for cloud, tree in zip(clouds, trees, strict=True):
            gicp.estimate_normals_covariances(cloud, tree, NEIGHBOURS)
        return trees

    tree, _ = prepare(None)
    options = {
        'max_correspondence_distance': setting.distance * case.spacing,
        'translation_epsilon': LOOSE * case.spacing,
    }
    return {
        'downsampling': lambda _: [reduce(points) for points in (case.target, case.source)],
        'preparation': prepare,
        'solve': lambda T_guess: gicp.align(*clouds, tree, T_guess, **options),
    }


def reaches(case, run, T_guess):
    """Whether a run from a guess ends within 1 deg and half the spacing of the truth."""
    return succeeded(case, *errors(case, run(T_guess)))
