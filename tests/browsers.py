"""The browser that tests of pages use: Debian's Chromium, or another one, driven by
Playwright."""

import contextlib
import importlib.util
import shutil


def browser_path():
    """The browser, `None` where it or Playwright is not installed."""
    if importlib.util.find_spec("playwright") is None:
        return None
    return next(
        filter(
            None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))
        ),
        None,
    )


@contextlib.contextmanager
def chromium():
    """The browser, headless."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(
            executable_path=browser_path(), args=["--no-sandbox"]
        )
        yield found
        found.close()
