"""A service of this tree in a process of its own, and requests to it."""

import http.client
import json
import os
import re
import signal
import subprocess
import sys

from process_tree import children


class Service:
    """``exo-pin serve`` on a free port."""

    def __init__(self, *options, port=0, token=None):
        environment = os.environ | ({"EXO_PIN_TOKEN": token} if token else {})
        words = [sys.executable, "-m", "exo_pin.cli", "serve", "--port", str(port), *options]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, env=environment, text=True)
        line = self.process.stdout.readline()
        found = re.search(r"http://(.+?):(\d+)", line)
        assert found, line
        self.host, self.port = found[1], int(found[2])
        self.url = f"http://{found[1]}:{found[2]}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(60)
        self.process.stdout.close()

    def send(self, method, path, body=None, headers=None):
        """Status, headers and body of a response."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=600)
        try:
            connection.request(method, path, body, headers or {})
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def ask(self, name, question, **headers):
        """Status and document of the answer of a question, given as an object or as text."""
        text = question if isinstance(question, (str, bytes)) else json.dumps(question)
        status, _, body = self.send("POST", f"/{name}", text, {"Content-Type": "application/json"} | headers)
        return status, json.loads(body)

    def metric(self, name):
        """A number of the metrics."""
        text = self.send("GET", "/metrics")[2].decode()
        return float(re.search(rf"^{name} (\S+)$", text, re.MULTILINE)[1])

    def processes(self):
        """Numbers of the process and of those that it has started."""
        return [self.process.pid, *children(self.process.pid)]


def resident(pid):
    """Memory of a process, MB."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
