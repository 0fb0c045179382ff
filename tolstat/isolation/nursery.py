"""The nursery: a process with one thread that loads a model and forks workers of it.

It evaluates nothing. Its starter asks on a socket: 0, with three descriptors, for a
worker; the number of a process for its end. It ends when the starter does, and ends all
workers.
"""

import os
import pickle
import socket
import sys

from tolstat.errors import TolstatError, told
from tolstat.isolation import channel
from tolstat.isolation.channel import LENGTH
from tolstat.isolation.worker import serve
from tolstat.model.contract import Model, guarded
from tolstat.operating_system import (
    end_with_parent,
    exit_status,
    fork,
    kill_group,
    lead_group,
    prepare_forks,
    receive_descriptors,
    restore_environment,
)

START = 0


def main(descriptor: int) -> None:
    """Load the model that the first message names, and start workers of it."""
    control = socket.socket(fileno=descriptor)
    message = channel.receive(control)
    if message is None:
        return
    failure, digest = None, ""
    try:
        load, growth = pickle.loads(message)
        model = load()
        digest = model.source_digest
        with guarded(model, "preload"):
            model.preload()
    except TolstatError as error:
        failure = error
    except BaseException as error:
        failure = TolstatError(told(error))
    channel.send_object(control, (failure, digest))
    prepare_forks()
    restore_environment()
    workers = set[int]()
    while failure is None:
        data, descriptors = receive_descriptors(control, LENGTH.size, 3)
        if len(data) < LENGTH.size:
            break
        (number,) = LENGTH.unpack(data)
        if number == START:
            answer = _start(control, model, growth, descriptors)
            workers.add(answer)
        else:
            workers.discard(number)
            kill_group(number)
            answer = exit_status(number)
        control.sendall(LENGTH.pack(answer))
    for number in workers:
        kill_group(number)


def _start(
    control: socket.socket, model: Model, growth: int, descriptors: list[int]
) -> int:
    """Fork a worker; return the number of its process."""
    nursery = os.getpid()
    number = fork()
    if number == 0:
        try:
            end_with_parent(nursery)
            lead_group()
            control.close()
            requests, answers, log = descriptors
            for stream in (1, 2):
                os.dup2(log, stream)
            os.close(log)
            for text in (sys.stdout, sys.stderr):
                text.reconfigure(line_buffering=True, errors="backslashreplace")  # type: ignore[union-attr]
            serve(model, socket.socket(fileno=requests), answers, growth)
        finally:
            os._exit(0)
    for descriptor in descriptors:
        os.close(descriptor)
    return number
