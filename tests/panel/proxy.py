"""A proxy for browsers (SOCKS 5, RFC 1928): it takes every name for this computer, and bounds the speed of uploads."""
import contextlib
import socket
import socketserver
import struct
import threading
import time

NAME = 3  # RFC 1928, 5: the type of an address
PIECE = 1 << 16


class Proxy(socketserver.ThreadingTCPServer):
    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.address = f"127.0.0.1:{self.server_address[1]}"
        self.upload_speed = None  # bytes a second
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def close(self):
        self.shutdown()
        self.server_close()

    def handle_error(self, *_):
        pass  # a browser that hangs up, and a server that is gone on purpose


class Handler(socketserver.BaseRequestHandler):
    def handle(self):
        self.read(self.read(2)[1])
        self.request.sendall(b"\5\0")
        kind = self.read(4)[3]
        self.read(self.read(1)[0] if kind == NAME else 4)
        port, = struct.unpack("!H", self.read(2))
        with socket.create_connection(("127.0.0.1", port)) as server:
            self.request.sendall(b"\5\0\0\1" + bytes(6))
            threading.Thread(target=self.copy, args=(server, self.request), daemon=True).start()
            self.copy(self.request, server, slowly=True)

    def read(self, length):
        data = self.request.recv(length, socket.MSG_WAITALL)
        if len(data) < length:
            raise EOFError
        return data

    def copy(self, source, sink, slowly=False):
        with contextlib.suppress(OSError):
            while data := source.recv(PIECE):
                if slowly and self.server.upload_speed:
                    time.sleep(len(data) / self.server.upload_speed)
                sink.sendall(data)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_WR)
