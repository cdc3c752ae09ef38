"""Makes the page "Try it in the browser" of its parts and the WebAssembly module: one file that needs no network.

    python scripts/pages/browser.py MODULE.wasm OUTPUT.html
"""

import base64
import gzip
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
PAGE = ROOT / "browser" / "page"
# The view of the vehicle is that of the orchestrator's pages.
SHARED = ROOT / "orchestrator" / "report" / "src"
# Largest page, bytes.
LARGEST = 2_500_000


def page(module: bytes) -> str:
    """The page with the module in it. The same inputs give the same text."""

    def part(match: re.Match[str]) -> str:
        name = match[1]
        if name == "module":
            return base64.b64encode(gzip.compress(module, compresslevel=9, mtime=0)).decode()
        folder = PAGE if (PAGE / name).is_file() else SHARED
        text = (folder / name).read_text(encoding="utf-8")
        # The browser would take it for the end of the element that the part stands in.
        assert "</script" not in text and "</style" not in text, f"{name} ends its own element"
        return text

    return re.sub(r"\{\{([\w.]+)\}\}", part, (PAGE / "index.html").read_text(encoding="utf-8"))


def main() -> None:
    module, output = map(Path, sys.argv[1:])
    text = page(module.read_bytes())
    size = len(text.encode())
    if size > LARGEST:
        sys.exit(f"error: the page has {size} bytes, more than {LARGEST}")
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding="utf-8")
    print(f"{size / 1e6:.2f} MB  {output}")


if __name__ == "__main__":
    main()
