# Shared by the scripts: where things are, and what they need. Sourced, not run.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# A relative CARGO_TARGET_DIR is relative to where the script was started, as cargo takes it.
target="${CARGO_TARGET_DIR:-$root/target}"
[[ $target == /* ]] || target="$PWD/$target"
export CARGO_TARGET_DIR="$target"
fmus="$target/fmu"
cd "$root"

say() { printf '\n== %s\n' "$*"; }

fail() {
    printf 'error: %s\n' "$*" >&2
    exit 1
}

need_rust() {
    command -v cargo >/dev/null || fail "cargo was not found: install Rust from https://rustup.rs"
    command -v cc >/dev/null || command -v gcc >/dev/null || command -v clang >/dev/null ||
        fail "no C compiler was found (cc, gcc or clang): Rust needs one for linking"
}

# Makes .venv from tests/requirements.txt unless it is up to date. Sets $python to its interpreter.
need_python() {
    local system venv="$root/.venv" stamp wanted
    system="$(command -v python3 || true)"
    [[ -n $system ]] || fail "python3 was not found: install Python 3.10 or later"
    "$system" -c 'import sys; sys.exit(sys.version_info < (3, 10))' ||
        fail "$("$system" --version) is too old: Python 3.10 or later is needed"
    python="$venv/bin/python"
    stamp="$venv/installed"
    wanted="$("$system" --version) $(cksum <tests/requirements.txt)"
    if [[ ! -x $python || ! -f $stamp || $(<"$stamp") != "$wanted" ]]; then
        say "Installing the Python packages of tests/requirements.txt into .venv"
        "$system" -m venv --clear "$venv" ||
            fail "python3 -m venv failed: on Debian and Ubuntu install the package python3-venv"
        "$python" -m pip install --quiet --disable-pip-version-check --requirement tests/requirements.txt ||
            fail "pip could not install tests/requirements.txt: see its message above"
        printf '%s' "$wanted" >"$stamp"
    fi
}

# The built library of a crate, whatever the platform calls it.
library() {
    local name
    for name in "lib$1.so" "lib$1.dylib" "$1.dll"; do
        if [[ -f $target/release/$name ]]; then
            printf '%s' "$target/release/$name"
            return
        fi
    done
    fail "the library of $1 is not in $target/release"
}

# Builds the programs and the FMU libraries, and packs every FMU into $fmus. Arguments go to fmu-pack.
build_fmus() {
    need_rust
    say "Building in release"
    cargo build --release --locked --workspace
    say "Packing the FMUs"
    local plant controller licence licences=()
    plant="$(library fmu_plant)"
    controller="$(library fmu_controller)"
    for licence in LICENSE-*; do
        if [[ -f $licence ]]; then licences+=(--license "$licence"); fi
    done
    "$target/release/fmu-pack" "$plant" "$controller" --output "$fmus" "${licences[@]+"${licences[@]}"}" "$@"
}
