# Shared by the scripts in this folder; sourced, not run.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cache=${XDG_CACHE_HOME:-$HOME/.cache}/lucerna
command -v cargo >/dev/null 2>&1 || PATH=$HOME/.cargo/bin:$PATH

# A checkout of a build server is new: what incremental compiling keeps is of no use there, and keeping it takes time. All scripts have the
# same setting, for cargo builds everything again when it changes.
if [ -n "${CI:-}" ]; then export CARGO_INCREMENTAL=${CARGO_INCREMENTAL:-0}; fi

# Tests with invented input take the same numbers in every run; another number here takes others.
export PROPTEST_RNG_SEED=${PROPTEST_RNG_SEED:-1}

say() { printf '%s\n' "$*"; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

# stage NAME COMMAND...: runs the command and says how long it took. Stops the script when the command fails.
stage() {
    local name=$1 start=$SECONDS processor status=0
    processor=$(processor_seconds)
    shift
    printf '\n== %s\n' "$name"
    "$@" || status=$?
    if [ "$status" -eq 0 ]; then
        # Both figures: a stage that does not fill all cores could run beside another one.
        printf '== %s: ok, %d s, %d s of processor time\n' "$name" $((SECONDS - start)) $(($(processor_seconds) - processor))
    else
        printf '== %s: FAILED (exit code %d), %d s\n' "$name" "$status" $((SECONDS - start))
        exit "$status"
    fi
}

# Seconds of processor time of the programs that the script's own shell has waited for; 0 where the system does not tell. A subshell in the
# background counts when it has been waited for.
processor_seconds() {
    local -a fields=()
    if [ -r "/proc/$$/stat" ]; then read -ra fields <"/proc/$$/stat"; fi
    printf '%d' $(((${fields[15]:-0} + ${fields[16]:-0}) / $(getconf CLK_TCK 2>/dev/null || printf 100)))
}

# The version of a package in Cargo.lock.
locked_version() {
    awk -v name="$1" '$1 == "name" { found = ($3 == "\"" name "\"") } found && $1 == "version" { gsub(/"/, "", $3); print $3; exit }' \
        "$root/Cargo.lock"
}

# The options of `cargo test` that run the tests of a file: program_of tests/edges. Most files are modules of a program.
program_of() {
    local name=${1##*/} found programs
    mapfile -t programs < <(ls "$root"/tests/programs/*.rs)
    case $1 in
    tests/cli/*) programs=("$root/tests/programs/cli.rs") ;;
    *) programs=("${programs[@]/*\/cli.rs/}") ;;
    esac
    for found in "${programs[@]}"; do
        if [ -n "$found" ] && grep -q "^mod $name;" "$found"; then
            found=${found##*/}
            say "--test=${found%.rs} $name::"
            return
        fi
    done
    case $1 in
    tests/cli/*) say "--test=cli_$name" ;;
    *) say "--test=$name" ;;
    esac
}

# Where the manifests of installed Vulkan drivers lie.
icd_folders=(/usr/share/vulkan/icd.d /etc/vulkan/icd.d /usr/local/share/vulkan/icd.d)

# The manifest of the system's own lavapipe (Mesa's Vulkan driver for the CPU), the reference driver of the tests.
reference_icd() {
    local folder file
    for folder in "${icd_folders[@]}"; do
        for file in "$folder"/lvp_icd.json "$folder"/lvp_icd.*.json; do
            [ -f "$file" ] && { say "$file"; return 0; }
        done
    done
    return 1
}

# Only this driver is seen by everything started afterwards. The second variable is for loaders older than 1.3.207.
use_driver() {
    export VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1
}

# Validation settings that work with the layer versions of Debian 12 (1.3.239) and Debian 13 (1.4.309).
use_validation() {
    export VK_LAYER_ENABLES=VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT:VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT
    export VK_VALIDATION_SYNCVAL_SHADER_ACCESSES_HEURISTIC=1
}
