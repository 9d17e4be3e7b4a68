"""The arguments of the scripts that peers.py calls."""
import argparse
import pathlib


def parsed(doc):
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--size", required=True)
    parser.add_argument("--bounces", type=int, required=True)
    parser.add_argument("--spp", type=int, required=True)
    parser.add_argument("--runs", type=int, required=True)
    parser.add_argument("--environment", type=pathlib.Path)
    parser.add_argument("--diffuse", action="store_true")
    options = parser.parse_args()
    options.width, options.height = map(int, options.size.split("x"))
    return options
