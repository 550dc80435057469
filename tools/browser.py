"""Debian's Chromium, driven by Selenium: pages as people see them, for screenshots and tests."""

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
#: Nothing is looked up, and nothing of the browser's own is fetched.
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
    """Return what has to be installed before a browser can be started; empty if nothing.

    `modules` are further Python packages that are needed, by module.
    """
    needed = {"selenium": "selenium", **modules}
    debian = [package for command, package in COMMANDS.items() if not shutil.which(command)]
    python = [package for name, package in needed.items() if not importlib.util.find_spec(name)]
    parts = [f"apt-get install {' '.join(debian)}"] if debian else []
    parts += [f"{sys.executable} -m pip install {' '.join(python)}"] if python else []
    return "; ".join(parts)


class Traffic(NamedTuple):
    """Requested addresses, and those that failed with the reason."""

    requested: list[str]
    failed: list[str]


class Browser:
    """One window. Its size is that of the page, not of the frame around it."""

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
        """Give a command of the DevTools protocol."""
        return dict(self.driver.execute_cdp_cmd(command, parameters))

    def window(self, width: int, height: int = 900, *, scale: float = 1) -> None:
        """Set the size of the page in CSS pixels, and how many pixels of the screen one takes."""
        size = {"width": width, "height": height, "deviceScaleFactor": scale}
        self.do("Emulation.setDeviceMetricsOverride", **size, mobile=False)

    def medium(self, *, dark: bool = False, printed: bool = False) -> None:
        """Choose the style of a page; nothing moves in any."""
        wanted = {
            "prefers-color-scheme": "dark" if dark else "light",
            "prefers-reduced-motion": "reduce",
        }
        features = [{"name": name, "value": value} for name, value in wanted.items()]
        medium = "print" if printed else ""  # the window's own; "screen" would hold for a PDF, too
        self.do("Emulation.setEmulatedMedia", media=medium, features=features)

    def scripts(self, *, on: bool) -> None:
        """Say if scripts of pages run; ours do always."""
        self.do("Emulation.setScriptExecutionDisabled", value=not on)

    def open(self, address: str) -> None:
        """Go to a page, and wait until all of it is there."""
        self.driver.get("about:blank")  # a mere change of #anchor would load nothing
        self.driver.get(address)

    def run(self, script: str, *given: Any) -> Any:
        """Return what a script, the body of a function, returns."""
        return self.driver.execute_script(script, *given)

    def picture(self) -> bytes:
        """Return what is in the window as PNG."""
        return base64.b64decode(self.do("Page.captureScreenshot", format="png")["data"])

    def pdf(self) -> bytes:
        """Return the page as it is printed on A4, or on the sheets that its style asks for."""
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
            given = message["params"]
            if event == "Network.requestWillBeSent":
                if not given["request"]["url"].startswith("data:"):
                    requested[given["requestId"]] = given["request"]["url"]
            elif event == "Network.loadingFailed" and not given.get("canceled"):
                failed.append(f"{requested.get(given['requestId'], '?')}: {given['errorText']}")
            elif event == "Network.responseReceived" and given["response"]["status"] >= 400:
                failed.append(f"{given['response']['url']}: {given['response']['status']}")
        return Traffic(list(requested.values()), failed)


@contextmanager
def browser() -> Iterator[Browser]:
    """Start a browser, and end it."""
    window = Browser()
    try:
        yield window
    finally:
        window.close()


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve a folder on this machine alone, as long as the context lasts; yield its address."""
    handler = partial(_Quiet, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/"
        finally:
            server.shutdown()
            thread.join()
