"""Runs the mutations of ci/mutations; see ci/mutants."""

import argparse
import fcntl
import fnmatch
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path

# A test that takes longer than this many times its time without the bug, and longer than LEAST seconds, hangs.
PATIENCE, LEAST = 10, 600

CAUGHT, SURVIVED, BROKEN, HUNG, CRASHED = "caught", "SURVIVED", "did not build", "HUNG", "CRASHED"


def fail(message):
    print(f"error: {message}", file=sys.stderr)
    sys.exit(2)


def read_table(root):
    """The mutations, in the order of their tests."""
    keys = {"name", "file", "old", "new", "test", "case"}
    mutants, wrong = [], []
    for path in sorted((root / "ci/mutations").glob("*.toml")):
        try:
            listed = tomllib.loads(path.read_text())["mutant"]
        except (tomllib.TOMLDecodeError, KeyError) as error:
            fail(f"{path}: {error}; a file of mutations has [[mutant]] tables")
        for m in listed:
            if set(m) != keys:
                fail(f"{path}: {m.get('name', m)}: its keys are {sorted(m)}, not {sorted(keys)}")
            mutants.append(m | {"class": path.stem})
    names = [m["name"] for m in mutants]
    wrong += [f"{name} is there more than once" for name in {n for n in names if names.count(n) > 1}]
    for m in mutants:
        path = root / m["file"]
        text = path.read_text() if path.is_file() else None
        if text is None:
            wrong.append(f"{m['name']}: there is no {m['file']}")
        elif text.count(m["old"]) != 1:
            wrong.append(f"{m['name']}: {m['old']!r} is {text.count(m['old'])} times in {m['file']}, not once")
        if "\n" in m["old"] + m["new"] or m["old"] == m["new"]:
            wrong.append(f"{m['name']}: a mutation changes one line")
        if not test_is_there(root, m):
            wrong.append(f"{m['name']}: there is no test {m['case']} in {m['test']}")
        m["test"], before = program(root, m["test"])
        m["case"] = before + m["case"]
    if wrong:
        fail("ci/mutations does not fit the tree:\n  " + "\n  ".join(wrong))
    return sorted(mutants, key=lambda m: (package(m["test"]), m["test"]))


def package(test):
    return "lucerna-samples" if test.startswith("cli") or test == "samples-lib" else "lucerna"


def program(root, test):
    """The program that has a file of tests, and how the names of its tests begin there."""
    module = test.removeprefix("cli_")
    for path in sorted((root / "tests/programs").glob("*.rs")):
        if (path.stem == "cli") == test.startswith("cli_") and re.search(rf"^mod {module};$", path.read_text(), re.M):
            return path.stem, f"{module}::"
    return test, ""


def test_is_there(root, mutant):
    test, name = mutant["test"], mutant["case"].split("::")[-1]
    if test == "lib":
        files = (root / "engine").rglob("*.rs")
    elif test == "samples-lib":
        files = (root / "samples/cli").rglob("*.rs")
    elif test.startswith("cli_"):
        files = [root / "tests/cli" / f"{test[4:]}.rs"]
    else:
        files = [root / "tests" / f"{test}.rs"]
    pattern = re.compile(rf"\bfn {re.escape(name)}\(")
    return any(file.is_file() and pattern.search(file.read_text()) for file in files)


def sync(root, tree):
    """Makes `tree` equal to what git sees of `root`, and gives a digest of what answers depend on. Files that are equal keep their times."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z", "-co", "--exclude-standard"], check=True, stdout=subprocess.PIPE)
    names = sorted(name for name in listed.stdout.decode().split("\0") if name and (root / name).is_file())
    # Written by ci/setup: where the shader compiler lies.
    names += [name for name in [".cargo/config.toml"] if (root / name).is_file() and name not in names]
    digest = hashlib.sha256()
    for name in names:
        data = (root / name).read_bytes()
        # Pages and this table change no answer.
        if not name.endswith(".md") and not name.startswith(("docs/", "ci/mut")):
            digest.update(f"{name}\0{len(data)}\0".encode() + data)
        to = tree / name
        if not to.is_file() or to.read_bytes() != data:
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_bytes(data)
    known = set(names)
    for folder, folders, files in os.walk(tree):
        folders[:] = [f for f in folders if f not in (".git", "target")]
        for file in files:
            path = Path(folder) / file
            if str(path.relative_to(tree)) not in known:
                path.unlink()
    # Tests look for the assets beside the checkout.
    beside = tree.parent / "shared"
    if (root.parent / "shared").is_dir() and not beside.exists():
        beside.symlink_to(root.parent / "shared")
    return digest.hexdigest()


# Shaders are replaced at run time, without a build. Rust code is built for each bug, so it is built fast.
SHADERS = ["--features", "lucerna/replaceable-shaders"]
RUST = ["--config", "profile.dev.opt-level=0"]


def cargo(tree, target, test, how, more, limit=None, shaders=None):
    """Runs `cargo test` for one target. Exit code (None: stopped after `limit` seconds) and what it printed."""
    which = ["--lib"] if test in ("lib", "samples-lib") else ["--test", test]
    return run(tree, target, ["test", "--quiet", "-p", package(test), *how, *which, *more], limit, shaders)


def run(tree, target, arguments, limit=None, shaders=None):
    """Runs cargo, as `cargo`."""
    command = ["cargo", *arguments]
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target), CARGO_TERM_COLOR="never", CI="1", RUST_BACKTRACE="0")
    if shaders:
        environment["LUCERNA_SHADERS"] = str(shaders)
    # A group of its own, so that programs that the test has started end with it.
    process = subprocess.Popen(
        command, cwd=tree, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True
    )
    try:
        out, _ = process.communicate(timeout=limit)
        return process.returncode, out
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)
        out, _ = process.communicate()
        return None, out
    except KeyboardInterrupt:
        os.killpg(process.pid, 9)
        raise


def tail(text, lines=25):
    return "\n".join("    " + line for line in text.strip().splitlines()[-lines:])


def unmutated(tree, target, test, how, cases):
    """Seconds of each test without a bug. Ends the run if one does not pass: it would catch anything."""
    code, out = cargo(tree, target, test, how, ["--no-run"])
    if code != 0:
        fail(f"{test} does not build as it is\n{tail(out)}")
    seconds = {}
    for case in sorted(cases):
        begun = time.monotonic()
        code, out = cargo(tree, target, test, how, ["--", "--exact", case])
        if code != 0 or not re.search(r"^test result: ok\. 1 passed", out, re.M):
            fail(f"{test}: {case} must pass as it is\n{tail(out)}")
        seconds[case] = time.monotonic() - begun
    return seconds


def bug(mutant):
    """What an answer is for: the bug and its test."""
    return "\0".join(mutant[key] for key in ("file", "old", "new", "test", "case"))


def of_shader(mutant):
    return mutant["file"].startswith("shaders-glsl/")


def compiled(tree, target, mutant, out):
    """Compiles the shaders that a bug changes into the folder `out`. `None`: they have another interface. Otherwise exit code and output."""
    bugged = out.parent / "bugged"
    shutil.rmtree(bugged, ignore_errors=True)
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(tree / "shaders-glsl", bugged)
    out.mkdir()
    path = bugged / Path(mutant["file"]).relative_to("shaders-glsl")
    path.write_text(path.read_text().replace(mutant["old"], mutant["new"]))
    program = target / "debug/examples/compile_shaders"
    done = subprocess.run([program, tree / "shaders-glsl", bugged, out], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return None if done.returncode == 3 else (done.returncode, done.stdout)


def answer(tree, target, mutant, how, seconds):
    """Plants one bug, runs its test, and takes the bug out again."""
    limit = max(LEAST, PATIENCE * seconds)
    test = [mutant["test"], how, ["--", "--exact", mutant["case"]], limit]
    modules = target.parent / "modules"
    replaced = compiled(tree, target, mutant, modules) if of_shader(mutant) else None
    if replaced:
        code, out = replaced
        if code != 0:
            return BROKEN, out
        code, out = cargo(tree, target, *test, modules)
    else:
        path = tree / mutant["file"]
        text = path.read_text()
        try:
            path.write_text(text.replace(mutant["old"], mutant["new"]))
            code, out = cargo(tree, target, mutant["test"], how, ["--no-run"])
            if code != 0:
                return BROKEN, out
            code, out = cargo(tree, target, *test)
        finally:
            path.write_text(text)
            if replaced is None and of_shader(mutant):
                cargo(tree, target, mutant["test"], how, ["--no-run"])
    if code is None:
        return HUNG, out
    if code == 0:
        return SURVIVED, out
    # A failed assertion, not a killed process.
    failed = re.search(r"^test result: FAILED\. 0 passed; 1 failed", out, re.M) and "panicked at" in out
    return (CAUGHT if failed else CRASHED), out


def main():
    parser = argparse.ArgumentParser(prog="ci/mutants", allow_abbrev=False)
    parser.add_argument("--root", type=Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--work", type=Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--only", action="append", default=[], metavar="NAME")
    parser.add_argument("--class", action="append", default=[], dest="classes", metavar="NAME")
    parser.add_argument("--shard", default="1/1", metavar="I/N")
    parser.add_argument("--again", action="store_true")
    args = parser.parse_args()
    root = args.root.resolve()
    mutants = read_table(root)

    for given, key in [(args.only, "name"), (args.classes, "class")]:
        for pattern in given:
            if not any(fnmatch.fnmatchcase(m[key], pattern) for m in mutants):
                fail(f"no mutation has the {key} {pattern}; --list shows all")
        if given:
            mutants = [m for m in mutants if any(fnmatch.fnmatchcase(m[key], p) for p in given)]
    shard = re.fullmatch(r"(\d+)/(\d+)", args.shard)
    if not shard or not 1 <= int(shard[1]) <= int(shard[2]):
        fail(f"--shard {args.shard}: give it as I/N, from 1/N to N/N")
    # Neighbours share a test, so that each machine builds few of them.
    part, parts = int(shard[1]), int(shard[2])
    mutants = mutants[len(mutants) * (part - 1) // parts : len(mutants) * part // parts]
    if args.list or args.check:
        for m in mutants if args.list else []:
            print(f"{m['name']:44} {m['class']:16} {m['test']}::{m['case']}")
        print(f"{len(mutants)} mutations of {len({m['file'] for m in mutants})} files; the table fits the tree")
        return 0

    work = args.work / f"{part}-of-{parts}"
    tree, target, answers = work / "tree", work / "target", work / "answers.jsonl"
    tree.mkdir(parents=True, exist_ok=True)
    lock = open(work / "lock", "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        fail(f"another run works in {work}")
    digest = sync(root, tree)
    known = {}
    if answers.is_file() and not args.again:
        for line in answers.read_text().splitlines():
            try:
                entry = json.loads(line)
                # What went wrong otherwise may have been the machine.
                if entry["verdict"] in (CAUGHT, SURVIVED):
                    known[entry["tree"], entry["bug"]] = entry
            except (ValueError, KeyError, TypeError):
                continue  # the last line of a run that was killed

    results, begun = [], time.monotonic()
    todo = [m for m in mutants if (digest, bug(m)) not in known]
    results += [known[digest, bug(m)] | {"name": m["name"]} for m in mutants if (digest, bug(m)) in known]
    if results:
        print(f"{len(results)} were answered by an earlier run of this tree", flush=True)
    todo.sort(key=of_shader)
    if any(of_shader(m) for m in todo):
        code, out = run(tree, target, ["build", "--quiet", "-p", "lucerna", *SHADERS, "--example", "compile_shaders"])
        if code != 0:
            fail(f"tests/tools/compile_shaders.rs does not build\n{tail(out)}")
    for shader, test in dict.fromkeys((of_shader(m), m["test"]) for m in todo):
        group = [m for m in todo if (of_shader(m), m["test"]) == (shader, test)]
        print(f"\n== {test}: {len(group)} mutations of {'shaders' if shader else 'Rust'}", flush=True)
        how = SHADERS if shader else RUST
        seconds = unmutated(tree, target, test, how, {m["case"] for m in group})
        for m in group:
            start = time.monotonic()
            verdict, out = answer(tree, target, m, how, seconds[m["case"]])
            took = time.monotonic() - start
            print(f"{verdict:14} {took:6.0f} s  {m['name']}", flush=True)
            if verdict != CAUGHT:
                print(tail(out), flush=True)
            results.append({"tree": digest, "bug": bug(m), "name": m["name"], "verdict": verdict, "seconds": round(took, 1)})
            with open(answers, "a") as file:
                file.write(json.dumps(results[-1]) + "\n")

    print(f"\n{'verdict':14} {'seconds':>8}  {'class':16} {'mutation':44} test")
    of = {m["name"]: m for m in mutants}
    for r in sorted(results, key=lambda r: (r["verdict"] == CAUGHT, of[r["name"]]["class"], r["name"])):
        m = of[r["name"]]
        print(f"{r['verdict']:14} {r['seconds']:8.0f}  {m['class']:16} {m['name']:44} {m['test']}::{m['case']}")
    caught = sum(r["verdict"] == CAUGHT for r in results)
    print(f"\n{caught} of {len(results)} caught, {time.monotonic() - begun:.0f} s")
    return 0 if caught == len(results) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
