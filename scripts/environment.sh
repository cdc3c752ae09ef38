# Shared by the scripts: where things are, and what they need. Sourced, not run.
set -euo pipefail

# A service may be started without it.
export HOME="${HOME:-$(cd ~ && pwd)}"
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# A relative CARGO_TARGET_DIR is relative to where the script was started, as cargo takes it.
target="${CARGO_TARGET_DIR:-$root/target}"
[[ $target == /* ]] || target="$PWD/$target"
export CARGO_TARGET_DIR="$target"
fmus="$target/fmu"
# The profile of the programs that are built and run here: release, or dev, which the tests have built
# anyway.
export PROGRAM_PROFILE="${PROGRAM_PROFILE:-release}"
programs="$target/release"
if [[ $PROGRAM_PROFILE == dev ]]; then programs="$target/debug"; fi
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

# Makes the virtual environment $1 from the requirements file $2 unless it is up to date. Sets $python
# to its interpreter.
need_venv() {
    local system venv="$1" requirements="$2" stamp version
    system="$(command -v python3 || true)"
    [[ -n $system ]] || fail "python3 was not found: install Python 3.10 or later"
    "$system" -c 'import sys; sys.exit(sys.version_info < (3, 10))' ||
        fail "$("$system" --version) is too old: Python 3.10 or later is needed"
    python="$venv/bin/python"
    stamp="$venv/installed"
    version="$("$system" --version) $(cksum <"$requirements")"
    if [[ ! -x $python || ! -f $stamp || $(<"$stamp") != "$version" ]]; then
        say "Installing the Python packages of $requirements into ${venv#"$root/"}"
        "$system" -m venv --clear "$venv" ||
            fail "python3 -m venv failed: on Debian and Ubuntu install the package python3-venv"
        "$python" -m pip install --quiet --disable-pip-version-check --requirement "$requirements" ||
            fail "pip could not install $requirements: see its message above"
        printf '%s' "$version" >"$stamp"
    fi
}

# The Python of the tests.
need_python() {
    need_venv "$root/.venv" tests/requirements.txt
}

# Installs fmi-sim, an importer written in Rust, into the folder $1 unless this version is there.
fmi_sim=0.7.0
install_fmi_sim() {
    need_rust
    need_python
    if grep --quiet --no-messages "\"fmi-sim $fmi_sim " "$1/.crates.toml"; then return; fi
    say "Installing fmi-sim $fmi_sim into $1"
    # Its build reads C headers with libclang: the one of tests/requirements.txt, which has no headers of
    # its own.
    LIBCLANG_PATH="$("$python" -c 'import clang, os; print(os.path.join(clang.__path__[0], "native"))')" \
        BINDGEN_EXTRA_CLANG_ARGS="-I$(cc -print-file-name=include)" \
        cargo install fmi-sim --version "$fmi_sim" --locked --root "$1" --target-dir "$1/build"
    rm -rf "$1/build"
}

# For the tests: not optimised, it is built in a quarter of the time, and their runs are short.
tools="$target/tools"
install_tools() {
    CARGO_PROFILE_RELEASE_OPT_LEVEL=0 install_fmi_sim "$tools"
}

# The built library of a crate in a folder, whatever the platform calls it.
library() {
    local name
    for name in "lib$1.so" "lib$1.dylib" "$1.dll"; do
        if [[ -f $2/$name ]]; then
            printf '%s' "$2/$name"
            return
        fi
    done
    fail "the library of $1 is not in $2"
}

# The libraries that are packed as FMUs.
fmu_libraries=(fmu_plant_library fmu_optimising fmu_feedback)

# The folder with the icons and the generated descriptions of the FMUs in the library $1.
fmu_folder() {
    if [[ $1 == fmu_plant_library ]]; then echo fmu-plant; else echo fmu-controller; fi
}

# Packs every FMU of the libraries in the folder $1 into the folder $2, and for FMI 3.0 into fmi3
# beside it, together with their builds for other platforms in the folders $also, if that is set.
# Further arguments go to fmu-pack, which runs in the folder with the icons: paths among them are
# relative to that folder.
pack_fmus() {
    say "Packing the FMUs"
    local name library licence folder others licences=()
    for licence in "$root"/LICENSE-*; do
        if [[ -f $licence ]]; then licences+=(--license "$licence"); fi
    done
    for name in "${fmu_libraries[@]}"; do
        library="$(library "$name" "$1")"
        others=()
        for folder in "${also[@]+"${also[@]}"}"; do
            others+=(--also "$(library "$name" "$folder")")
        done
        (cd "$(fmu_folder "$name")" && "$programs/fmu-pack" "$library" "${others[@]+"${others[@]}"}" \
            --output "$2" --fmi3 "$(dirname "$2")/fmi3" --icons icons "${licences[@]+"${licences[@]}"}" "${@:3}")
    done
}

# Downloads all crates, those of other platforms as well: the digest of a library's sources names all
# of them.
fetch() { cargo fetch --locked --quiet; }

# Builds the targets of the workspace that the arguments choose. With --workspace, every choice has
# the same features of the dependencies, so that none of them is built twice. With an example they
# have those of the tests, which the development profile is for.
build() {
    local like_tests=()
    if [[ $PROGRAM_PROFILE == dev ]]; then like_tests=(--example fmi_rs); fi
    fetch
    # The page for browsers is for another target (scripts/browser).
    cargo build --profile "$PROGRAM_PROFILE" --locked --workspace --exclude reentry-browser \
        "${like_tests[@]+"${like_tests[@]}"}" "$@"
}

# Builds the programs and the FMU libraries, and packs every FMU into $fmus. Arguments go to fmu-pack.
build_fmus() {
    need_rust
    say "Building the programs and the FMUs"
    build --lib --bin orchestrator --bin fmu-pack
    pack_fmus "$programs" "$fmus" "$@"
}
