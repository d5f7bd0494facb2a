"""A client of UR controllers that shares no code with any other: byte for byte by UR's guide."""

import socket
import struct

from tests.hw.drivers.rigs import PATIENCE_S


class Client:
    """A link to one port, that is read byte by byte."""

    def __init__(self, host, port):
        self.link = socket.create_connection((host, port), PATIENCE_S)

    def exactly(self, size):
        data = b""
        while len(data) < size:
            piece = self.link.recv(size - len(data))
            assert piece, "it has hung up"
            data += piece
        return data

    def line(self):
        data = b""
        while not data.endswith(b"\n"):
            data += self.exactly(1)
        return data.decode()[:-1]

    def ask(self, line):
        self.link.sendall(line.encode() + b"\n")
        return self.line()

    def package(self):
        size, kind = struct.unpack(">HB", self.exactly(3))
        return chr(kind), self.exactly(size - 3)

    def send(self, kind, content=b""):
        self.link.sendall(struct.pack(">HB", 3 + len(content), ord(kind)) + content)

    def answer(self, kind, content=b""):
        """What is answered; data packages in between are skipped."""
        self.send(kind, content)
        while True:
            got, answer = self.package()
            if got == kind:
                return answer
