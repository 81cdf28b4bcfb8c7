"""The server's side of a WebSocket (RFC 6455) on a request of http.server: text frames without fragments."""
import base64
import hashlib
import struct
import threading

GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"  # RFC 6455, 1.3
CLOSE = 8


class WebSocket:
    def __init__(self, handler):
        """Answers the handshake of a BaseHTTPRequestHandler."""
        key = handler.headers["Sec-WebSocket-Key"] + GUID
        handler.send_response(101)
        handler.send_header("Upgrade", "websocket")
        handler.send_header("Connection", "Upgrade")
        handler.send_header("Sec-WebSocket-Accept", base64.b64encode(hashlib.sha1(key.encode()).digest()).decode())
        handler.end_headers()
        handler.close_connection = True
        self.reader, self.writer, self.lock = handler.rfile, handler.wfile, threading.Lock()

    def texts(self):
        """Yields the client's messages until it leaves."""
        try:
            while (text := self.read()) is not None:
                yield text
        except (OSError, struct.error):
            pass

    def read(self):
        head, length = struct.unpack("!BB", self.reader.read(2))
        length &= 127
        if length > 125:
            length, = struct.unpack("!H" if length == 126 else "!Q", self.reader.read(2 if length == 126 else 8))
        mask, data = self.reader.read(4), self.reader.read(length)
        return None if head & 15 == CLOSE else bytes(byte ^ mask[i % 4] for i, byte in enumerate(data)).decode()

    def send(self, text):
        data = text.encode()
        length = len(data)
        if length < 126:
            head = struct.pack("!BB", 0x81, length)
        else:
            head = struct.pack("!BBH", 0x81, 126, length) if length < 1 << 16 else struct.pack("!BBQ", 0x81, 127, length)
        try:
            with self.lock:
                self.writer.write(head + data)
        except (OSError, ValueError):
            pass  # the client left
