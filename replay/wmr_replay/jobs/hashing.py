"""The hash of a log's files, found in a thread while the log is read; hashing leaves Python's lock."""

from concurrent.futures import Future
from threading import Thread

from wmr_replay.ingest import LogPath, RemotePath, sha256_of


class LogHash:
    """Begins at once; :meth:`result` waits for the hash. That of a URL is found before anything is read."""

    def __init__(self, path: LogPath) -> None:
        self._path, self._found = path, Future[str]()
        if isinstance(path, RemotePath):
            self._find()
        else:  # an interrupted program does not wait for it
            Thread(target=self._find, name="hash", daemon=True).start()

    def _find(self) -> None:
        try:
            self._found.set_result(sha256_of(self._path))
        except Exception as error:  # the caller's, as soon as it asks
            self._found.set_exception(error)

    def result(self) -> str:
        """The hash; raises what hashing raised."""
        return self._found.result()
