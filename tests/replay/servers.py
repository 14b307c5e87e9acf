"""Local servers on loopback: files over HTTP, with and without ranges, and the parts of S3 in use."""

import hashlib
import io
import re
import threading
import uuid
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape

RANGE = re.compile(r"bytes=(\d+)-(\d*)")


def dechunked(stream):
    """What chunks of a stream hold, up to the empty one."""
    out = bytearray()
    while size := int(stream.readline().partition(b";")[0], 16):
        out += stream.read(size)
        stream.readline()
    return bytes(out)


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self, status, content=b"", headers=(), *, head=False):
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if not head:
            try:
                self.wfile.write(content)
            except (BrokenPipeError, ConnectionResetError):  # the client saw enough
                self.close_connection = True

    def answer_file(self, content, headers, *, ranges, head=False):
        match = RANGE.fullmatch(self.headers.get("Range", "")) if ranges else None
        if match is None or head:
            self.server.sent.append(0 if head else len(content))
            self.answer(200, content, [*headers, ("Accept-Ranges", "bytes" if ranges else "none")], head=head)
            return
        start, stop = int(match[1]), int(match[2] or len(content) - 1) + 1
        piece = content[start:stop]
        self.server.sent.append(len(piece))
        where = f"bytes {start}-{start + len(piece) - 1}/{len(content)}"
        self.answer(206, piece, [*headers, ("Content-Range", where)])


class FileHandler(Handler):
    def do_GET(self, head=False):
        path = self.server.folder / unquote(urlsplit(self.path).path).lstrip("/")
        if not path.is_file():
            self.answer(404, head=head)
            return
        content = path.read_bytes()
        etag = [("ETag", f'"{hashlib.md5(content).hexdigest()}"')]
        self.answer_file(content, etag, ranges=self.server.ranges, head=head)

    def do_HEAD(self):
        self.do_GET(head=True)


class Server(ThreadingHTTPServer):
    """Runs in a thread; ``sent`` holds the bytes of every body."""

    daemon_threads = True

    def __init__(self, handler):
        super().__init__(("127.0.0.1", 0), handler)
        self.sent = []
        self.url = f"http://127.0.0.1:{self.server_address[1]}"

    def __enter__(self):
        threading.Thread(target=self.serve_forever, args=(0.05,), daemon=True).start()
        return self

    def __exit__(self, *_):
        self.shutdown()
        self.server_close()

    def handle_error(self, *_):
        pass


class FileServer(Server):
    """The files of a folder."""

    def __init__(self, folder: Path, *, ranges: bool = True) -> None:
        super().__init__(FileHandler)
        self.folder, self.ranges = folder, ranges


class S3Handler(Handler):
    """Objects in memory: put, get by ranges, head, list, delete, uploads in parts; anybody may."""

    @property
    def place(self):
        parts = urlsplit(self.path)
        bucket, _, key = unquote(parts.path).lstrip("/").partition("/")
        return bucket, key, parse_qs(parts.query, keep_blank_values=True)

    def body(self):
        """The content, out of up to two layers of chunks: HTTP's and, inside it, S3's with a trailer."""
        if self.headers.get("Transfer-Encoding") == "chunked":
            data = dechunked(self.rfile)
            self.rfile.readline()
        else:
            data = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        return (
            dechunked(io.BytesIO(data)) if "aws-chunked" in self.headers.get("Content-Encoding", "") else data
        )

    def xml(self, text):
        self.answer(
            200, f'<?xml version="1.0" encoding="UTF-8"?>{text}'.encode(), [("Content-Type", "text/xml")]
        )

    def do_PUT(self):
        bucket, key, query = self.place
        data = self.body()
        if not key:
            self.server.buckets.setdefault(bucket, {})
        elif "partNumber" in query:
            self.server.uploads[query["uploadId"][0]][int(query["partNumber"][0])] = data
        else:
            self.server.buckets[bucket][key] = data
            self.server.puts.append(key)
        self.answer(200, headers=[("ETag", f'"{hashlib.md5(data).hexdigest()}"')])

    def do_POST(self):
        bucket, key, query = self.place
        data = self.body()
        if "uploads" in query:
            upload = uuid.uuid4().hex
            self.server.uploads[upload] = {}
            self.xml(
                f"<InitiateMultipartUploadResult><Bucket>{bucket}</Bucket><Key>{escape(key)}</Key>"
                f"<UploadId>{upload}</UploadId></InitiateMultipartUploadResult>"
            )
        elif "uploadId" in query:
            parts = self.server.uploads.pop(query["uploadId"][0])
            self.server.buckets[bucket][key] = b"".join(parts[k] for k in sorted(parts))
            self.server.puts.append(key)
            self.xml(
                f'<CompleteMultipartUploadResult><ETag>"x"</ETag><Key>{escape(key)}</Key>'
                "</CompleteMultipartUploadResult>"
            )
        elif "delete" in query:
            for found in re.findall(rb"<Key>(.*?)</Key>", data):
                self.server.buckets[bucket].pop(found.decode(), None)
            self.xml("<DeleteResult></DeleteResult>")

    def do_DELETE(self):
        bucket, key, _ = self.place
        self.server.buckets[bucket].pop(key, None)
        self.answer(204)

    def do_HEAD(self):
        self.do_GET(head=True)

    def do_GET(self, head=False):
        bucket, key, query = self.place
        objects = self.server.buckets.get(bucket)
        if objects is None or (key and key not in objects):
            self.answer(404, head=head)
        elif not key and head:
            self.answer(200, headers=[("x-amz-bucket-region", "us-east-1")], head=True)
        elif not key:
            self.list(objects, query)
        else:
            stamp = [
                ("ETag", f'"{hashlib.md5(objects[key]).hexdigest()}"'),
                ("Last-Modified", "Sat, 01 Aug 2026 00:00:00 GMT"),
            ]
            self.answer_file(objects[key], stamp, ranges=True, head=head)

    def list(self, objects, query):
        prefix, mark = query.get("prefix", [""])[0], query.get("delimiter", [""])[0]
        folders, rows = set(), []
        for key in sorted(k for k in list(objects) if k.startswith(prefix)):
            rest = key[len(prefix) :]
            if mark and mark in rest:
                folders.add(prefix + rest.partition(mark)[0] + mark)
            else:
                rows.append(
                    f"<Contents><Key>{escape(key)}</Key><Size>{len(objects[key])}</Size>"
                    "<LastModified>2026-08-01T00:00:00.000Z</LastModified></Contents>"
                )
        rows += [
            f"<CommonPrefixes><Prefix>{escape(name)}</Prefix></CommonPrefixes>" for name in sorted(folders)
        ]
        self.xml(
            f"<ListBucketResult><IsTruncated>false</IsTruncated><KeyCount>{len(rows)}</KeyCount>"
            f"{''.join(rows)}</ListBucketResult>"
        )


class S3Server(Server):
    """``buckets[name][key]`` holds the objects, ``puts`` their keys in the order of their completion."""

    def __init__(self, *buckets: str) -> None:
        super().__init__(S3Handler)
        self.buckets = {name: {} for name in buckets}
        self.uploads, self.puts = {}, []
