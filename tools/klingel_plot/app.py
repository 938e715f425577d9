"""The command line of tools/plot.py."""

from __future__ import annotations

import argparse
import io
import json
import sys

from . import figure


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="plot.py", formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Reads the description of a picture (JSON, standard input), writes the picture to standard output.\n"
                    "klingel starts it for --plot.\n\n" + (figure.__doc__ or ""))
    parser.parse_args()
    try:
        picture = io.BytesIO()  # nothing is written unless all of it can be
        figure.draw(json.load(sys.stdin), picture)
        sys.stdout.buffer.write(picture.getvalue())
        sys.stdout.buffer.flush()
    except ImportError as error:
        name = error.name or "matplotlib"
        print(f"the Python module {name} is missing (Debian package python3-matplotlib)", file=sys.stderr)
        return 1
    except (figure.DescriptionError, json.JSONDecodeError) as error:
        print(f"not a description of a picture: {error}", file=sys.stderr)
        return 1
    except (OSError, ValueError) as error:
        print(f"{error}", file=sys.stderr)
        return 1
    return 0
