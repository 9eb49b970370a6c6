"""A learning record store on loopback, with its statements in a folder: Ralph (PyPI ralph-malph).

    record_store.py FOLDER PORT

Knows one station, `station` with the secret `secret`. Runs until it is ended.
"""

import os
import pathlib
import subprocess
import sys


def main(arguments):
    folder, port = pathlib.Path(arguments[0]), int(arguments[1])
    statements = folder / "statements"
    statements.mkdir(parents=True, exist_ok=True)
    # Ralph reads these as it is imported.
    os.environ.update(
        RALPH_APP_DIR=str(folder),
        RALPH_AUTH_FILE=str(folder / "auth.json"),
        RALPH_RUNSERVER_BACKEND="fs",
        RALPH_BACKENDS__LRS__FS__DEFAULT_DIRECTORY_PATH=str(statements),
    )
    os.chdir(folder)
    if not (folder / "auth.json").exists():
        ralph = pathlib.Path(sys.executable).with_name("ralph")
        command = [ralph, "auth", "-u", "station", "-p", "secret", "-s", "all", "-N", "station", "-M", "mailto:station@example.org"]
        subprocess.run([*command, "--write-to-disk"], check=True, stdout=subprocess.DEVNULL)
    from ralph.backends.data.base import BaseOperationType
    from ralph.backends.data.fs import FSDataBackend

    # Left alone, this backend makes its file once and then refuses to write to it.
    FSDataBackend.default_operation_type = BaseOperationType.APPEND
    import uvicorn
    from ralph.api import app

    uvicorn.run(app, host="127.0.0.1", port=port, log_level="warning")


if __name__ == "__main__":
    main(sys.argv[1:])
