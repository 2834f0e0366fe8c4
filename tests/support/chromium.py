"""Control of a headless Chromium by mouse and keys, as by a user, and access to the state of the page."""

import shutil
from contextlib import contextmanager
from time import monotonic, sleep

BROWSERS = ("chromium", "chromium-browser", "google-chrome")

ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
    "--disable-dev-shm-usage",
)  # fmt: skip


def lacking():
    """Return the name of a program or package that is not installed, or "" if all that a browser needs is installed."""
    try:
        import selenium  # noqa: F401
    except ImportError:
        return "selenium is not installed"
    if not any(map(shutil.which, BROWSERS)):
        return "there is no Chromium on PATH (Debian: chromium)"
    return "" if shutil.which("chromedriver") else "there is no chromedriver on PATH (Debian: chromium-driver)"


@contextmanager
def browser(width=1250, height=810):
    """Yield a browser without an open page, whose window shows exactly `width` × `height` pixels of a page."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = next(filter(None, map(shutil.which, BROWSERS)))
    for argument in (*ARGUMENTS, f"--window-size={width},{height + 150}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(executable_path=shutil.which("chromedriver"))
    driver = webdriver.Chrome(options=options, service=service)
    try:
        tab = Tab(driver)
        tab.resize(width, height)
        yield tab
    finally:
        driver.quit()


class Tab:
    """The page of an explorer in a browser."""

    PATIENCE = 600.0
    """Time limit in seconds of short operations. It is so large because other programs may use the machine."""

    def __init__(self, driver):
        self.driver = driver

    def resize(self, width, height, touch=False):
        """Give the page exactly this size, without the bars of the browser. If `touch`, simulate a touch screen."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": touch})

    def open(self, address):
        self.driver.get(address)
        self.settle()

    def ask(self, script, *arguments):
        return self.driver.execute_script(f"const page = window.explorer; return {script}", *arguments)

    def until(self, condition, what):
        """Wait until a condition, JavaScript or a function, is true. `what` names the condition in messages."""
        end = monotonic() + self.PATIENCE
        while not (condition() if callable(condition) else self.ask(condition)):
            assert monotonic() < end, f"not within {self.PATIENCE} s: {what}; the page says {self.notice()!r}"
            sleep(0.02)

    def settle(self, condition="true"):
        """Wait for a condition, for the complete picture of the last request, and until the address contains it."""
        self.until(condition, str(condition))
        self.until("!!page && page.settled && page.begun && !page.waiting", "a settled picture")

    def state(self):
        return self.ask("page.state()")

    def mouse(self, kind, x, y):
        self.driver.execute_cdp_cmd(
            "Input.dispatchMouseEvent",
            {"type": f"mouse{kind}", "x": x, "y": y, "button": "left", "clickCount": 1,
             "buttons": 0 if kind == "Released" else 1},
        )  # fmt: skip

    def click(self, x, y):
        self.mouse("Pressed", x, y)
        self.mouse("Released", x, y)

    def drag(self, start, places):
        """Press the mouse button at `start`, move the mouse over `places`, and release the button at the last place."""
        self.mouse("Pressed", *start)
        for place in places:
            self.mouse("Moved", *place)
        self.mouse("Released", *place)

    def frame(self):
        """Return [left, top, width, height] of the frame of the picture, in pixels of the page."""
        return self.driver.execute_script(
            "const {left, top, width, height} = document.getElementById('frame').getBoundingClientRect();"
            "return [left, top, width, height]"
        )

    def choose(self, name, value):
        """Set a field as a user does."""
        self.ask("page.enter(...arguments)", name, value)

    def press(self, name):
        """Press the button with this id."""
        self.driver.execute_script("document.getElementById(arguments[0]).click()", name)

    def notice(self):
        return self.ask("page.refused")

    def complaints(self):
        """Return the warnings and errors in the console of the browser."""
        return [e["message"] for e in self.driver.get_log("browser") if e["level"] != "INFO"]
