"""A Chromium without a window by the WebDriver protocol (W3C), and the pages that it opens, over plain HTTP."""
import base64
import functools
import http.server
import json
import pathlib
import re
import subprocess
import tempfile
import threading
import urllib.error
import urllib.request

import numpy as np

FLAGS = ["--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


# Not by a proxy: all of this is on this machine.
OPEN = urllib.request.build_opener(urllib.request.ProxyHandler({})).open


class Pages(http.server.SimpleHTTPRequestHandler):
    """Files of several folders: the longest prefix of the address that is known names the folder."""

    def __init__(self, folders, *args):
        self.folders = folders
        super().__init__(*args)

    def translate_path(self, path):
        path = path.split("?")[0].split("#")[0]
        prefix = max((known for known in self.folders if path.startswith(known)), key=len)
        return str(self.folders[prefix] / path[len(prefix):])

    def log_message(self, *_):
        pass


def serve(folders):
    """Serves folders by their prefixes; returns the address."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Pages, folders))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}"


class Browser:
    def __init__(self, width, height):
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.profile = tempfile.TemporaryDirectory()
        for line in self.driver.stdout:
            if found := re.search(r"successfully on port (\d+)", line):
                break
        else:
            raise SystemExit("chromedriver did not say its port")
        self.address = f"http://127.0.0.1:{found[1]}/session"
        threading.Thread(target=self.driver.stdout.read, daemon=True).start()
        flags = FLAGS + [f"--user-data-dir={self.profile.name}", f"--window-size={width},{height}"]
        wanted = {"goog:chromeOptions": {"args": flags}, "goog:loggingPrefs": {"browser": "ALL"}, "timeouts": {"script": 300000}}
        self.address += "/" + self.ask("", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]

    def ask(self, path, body=None, method="POST"):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.address + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with OPEN(request, timeout=600) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise SystemExit(f"{path}: {json.load(error)['value']['message']}") from None

    def open(self, address):
        self.ask("/url", {"url": address})
        # Pages say when they are ready.
        self.run("while (document.documentElement.dataset.ready !== 'true') await new Promise((go) => setTimeout(go, 50));")

    def run(self, script):
        """Runs the body of an asynchronous function; returns what it returns."""
        whole = f"const done = arguments[0]; (async () => {{ {script} }})().then((v) => done({{ v }}), (e) => done({{ error: String(e) }}));"
        answer = self.ask("/execute/async", {"script": whole, "args": []})
        if "error" in answer:
            raise SystemExit(f"{script}: {answer['error']}; the console said: {self.complaints()}")
        return answer.get("v")

    def floats(self, expression):
        """An array of 32-bit floats."""
        script = f"const bytes = new Uint8Array((await {expression}).buffer); let text = '';"
        script += "for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));"
        return np.frombuffer(base64.b64decode(self.run(script + "return btoa(text);")), "<f4")

    def picture(self):
        """What the window shows, as PNG."""
        return base64.b64decode(self.ask("/screenshot", method="GET"))

    def complaints(self):
        return [entry["message"] for entry in self.ask("/se/log", {"type": "browser"})]

    def close(self):
        self.ask("", method="DELETE")
        self.driver.terminate()
        self.driver.wait()
        self.profile.cleanup()
