"""Control Debian's Chromium with Selenium: pages as people see them, for screenshots and tests."""

from __future__ import annotations

import base64
import importlib.util
import json
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

#: Debian package by command.
COMMANDS = {"chromium": "chromium", "chromedriver": "chromium-driver"}
#: Arguments of Chromium. It resolves no host names, and downloads nothing for itself.
ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-component-update",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-domain-reliability",
    "--metrics-recording-only",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--force-color-profile=srgb",
    "--autoplay-policy=no-user-gesture-required",
)


def missing(**modules: str) -> str:
    """Return the commands that install what a browser needs; "" if everything is installed.

    `modules` are other required Python packages, by module.
    """
    required = {"selenium": "selenium", **modules}
    debian = [package for command, package in COMMANDS.items() if not shutil.which(command)]
    python = [package for name, package in required.items() if not importlib.util.find_spec(name)]
    commands = []
    if debian:
        commands.append(f"apt-get install {' '.join(debian)}")
    if python:
        commands.append(f"{sys.executable} -m pip install {' '.join(python)}")
    return "; ".join(commands)


class Traffic(NamedTuple):
    """The requests of a page."""

    requested: list[str]  #: addresses
    failed: list[str]  #: addresses of failed requests with the reason


class Browser:
    """One window of the browser. Its size is the size of the page, without the window frame."""

    def __init__(self) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium") or "chromium"
        for argument in ARGUMENTS:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
        self.driver = webdriver.Chrome(
            options=options, service=Service(shutil.which("chromedriver"))
        )
        self.driver.set_script_timeout(120)

    def close(self) -> None:
        """End the browser."""
        self.driver.quit()

    def do(self, command: str, **parameters: Any) -> dict[str, Any]:
        """Execute a command of the DevTools protocol, and return its result."""
        return dict(self.driver.execute_cdp_cmd(command, parameters))

    def window(self, width: int, height: int = 900, *, scale: float = 1) -> None:
        """Set the size of the page in CSS pixels, and the screen pixels per CSS pixel."""
        size = {"width": width, "height": height, "deviceScaleFactor": scale}
        self.do("Emulation.setDeviceMetricsOverride", **size, mobile=False)

    def medium(self, *, dark: bool = False, printed: bool = False) -> None:
        """Choose the style of a page: light or dark, screen or print, always without motion."""
        features = [
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
            {"name": "prefers-reduced-motion", "value": "reduce"},
        ]
        # "" is the default of the window; "screen" would also apply to a PDF.
        medium = "print" if printed else ""
        self.do("Emulation.setEmulatedMedia", media=medium, features=features)

    def scripts(self, *, on: bool) -> None:
        """Enable or disable the scripts of pages; `run` always works."""
        self.do("Emulation.setScriptExecutionDisabled", value=not on)

    def open(self, address: str) -> None:
        """Open a page, and wait until it is loaded."""
        # Without the empty page, an address that differs only in its #anchor would load nothing.
        self.driver.get("about:blank")
        self.driver.get(address)

    def run(self, script: str, *arguments: Any) -> Any:
        """Run a script, which is the body of a function, and return its result."""
        return self.driver.execute_script(script, *arguments)

    def picture(self) -> bytes:
        """Return a screenshot of the window as PNG."""
        return base64.b64decode(self.do("Page.captureScreenshot", format="png")["data"])

    def pdf(self) -> bytes:
        """Return the page as PDF, on A4 or the paper size of its style sheet."""
        size = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": True}
        return base64.b64decode(self.do("Page.printToPDF", **size)["data"])

    def complaints(self) -> list[str]:
        """Return the messages of the console since the last call."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def traffic(self) -> Traffic:
        """Return the requests since the last call."""
        requested: dict[str, str] = {}
        failed = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            event = message["method"]
            params = message["params"]
            if event == "Network.requestWillBeSent":
                if not params["request"]["url"].startswith("data:"):
                    requested[params["requestId"]] = params["request"]["url"]
            elif event == "Network.loadingFailed" and not params.get("canceled"):
                failed.append(f"{requested.get(params['requestId'], '?')}: {params['errorText']}")
            elif event == "Network.responseReceived" and params["response"]["status"] >= 400:
                failed.append(f"{params['response']['url']}: {params['response']['status']}")
        return Traffic(list(requested.values()), failed)


@contextmanager
def browser() -> Iterator[Browser]:
    """Start a browser for the block, and end it."""
    window = Browser()
    try:
        yield window
    finally:
        window.close()


class _Quiet(SimpleHTTPRequestHandler):
    """A handler that logs nothing."""

    def log_message(self, format: str, *args: Any) -> None:
        """Ignore the message."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve a folder to this computer during the block, and yield the address."""
    handler = partial(_Quiet, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/"
        finally:
            server.shutdown()
            thread.join()
