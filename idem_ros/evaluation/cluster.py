"""Tasks done by the workers of a Dask scheduler (the extra "cluster")."""

import socket

from idem_ros.core.exceptions import IdemError
from idem_ros.evaluation.one_recording import Outcome, evaluated
from idem_ros.evaluation.worker_processes import failed
from idem_ros.terminal.printable import error_line

PATIENCE = 15.0  # [s] for the scheduler to answer, and for its first worker


class ClusterMissing(IdemError):
    """No Dask, no scheduler at the address, or one without workers."""


def on_cluster(tasks, address, patience=PATIENCE, call=evaluated):
    """Do tasks on a cluster: by default, evaluate recordings.

    The scheduler gives what a killed worker had to another worker, until more of them are lost
    over one task than its `allowed-failures` (3 by default).

    Workers read files by the paths of the tasks and send the results back; idem_ros must be
    installed where they run.

    Args:
        tasks, call: see `in_processes`.
        address: of the scheduler, such as tcp://10.0.0.1:8786.
        patience: for the scheduler and its first worker [s].

    Yields:
        (index, outcome) of each task, in the order in which they end, see `in_processes`.

    Raises:
        ClusterMissing: see there.
    """
    distributed = _distributed()
    with _client(distributed, address, patience) as client:
        indices_of = {client.submit(call, task, pure=False): i for i, task in enumerate(tasks)}
        ended = distributed.as_completed(list(indices_of), loop=client.loop)
        for future in ended:
            index = indices_of.pop(future)
            yield index, _outcome(distributed, tasks[index], future)


def _outcome(distributed, task, future):
    try:
        return future.result()
    except distributed.KilledWorker as error:
        times = error.allowed_failures + 1
        plural = 's' if times > 1 else ''
        return Outcome(task.path, reason=f'its worker was killed, {times} time{plural}')
    except Exception as error:
        return failed(task, error)


def _distributed():
    try:
        import distributed
    except ImportError as error:
        raise ClusterMissing(
            'a cluster needs dask.distributed; install it: pip install ".[cluster]"'
        ) from error
    return distributed


def _client(distributed, address, patience):
    try:
        # asked first: a Client that finds nobody prints tracebacks when it is deleted
        host_port = distributed.comm.get_address_host_port(address)
        socket.create_connection(host_port, timeout=patience).close()
        client = distributed.Client(address, timeout=patience, set_as_default=False)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        reason = error_line(error)
        raise ClusterMissing(
            f'no Dask scheduler answers at {address!r}, expected is HOST:PORT: {reason}'
        ) from error
    try:
        client.wait_for_workers(1, timeout=patience)
    except OSError as error:
        client.close()
        raise ClusterMissing(f'the Dask scheduler at {address} has no workers') from error
    return client
