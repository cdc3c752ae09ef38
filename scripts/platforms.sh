# Cross building of the FMUs and the orchestrator on Linux x86-64. Sourced after environment.sh.

# The platforms, by the names of their folders below $dist. Those of a single processor of macOS are
# for the wheels: one for both is larger than a wheel may be.
platforms=(linux-x86_64 linux-aarch64 windows-x86_64 macos-universal macos-x86_64 macos-aarch64)
dist="$target/dist"

# The oldest systems that the binaries run on: CentOS 7, manylinux2014 and macOS 11 of 2020.
glibc=2.17
macos=11.0

# The triples of rustc for the platform $1.
triples() {
    case "$1" in
    linux-x86_64) echo x86_64-unknown-linux-gnu ;;
    linux-aarch64) echo aarch64-unknown-linux-gnu ;;
    # Its sibling without "llvm" has no sections of functions, so that unused code stays.
    windows-x86_64) echo x86_64-pc-windows-gnullvm ;;
    macos-universal) echo x86_64-apple-darwin aarch64-apple-darwin ;;
    macos-x86_64) echo x86_64-apple-darwin ;;
    macos-aarch64) echo aarch64-apple-darwin ;;
    *) fail "there is no platform $1; there are ${platforms[*]}" ;;
    esac
}

# Gets the standard library for the triple $1 unless it is there; fails if it cannot be had.
get_target() {
    [[ -d $(rustc --print target-libdir --target "$1") ]] && return
    say "Installing Rust's standard library for $1"
    command -v rustup >/dev/null && rustup target add "$1"
}

need_target() {
    get_target "$1" || fail "rustup target add $1 failed: Rust's standard library for it is needed"
}

# Whether everything for the platform $1 is there or can be had.
can_build() {
    local triple
    for triple in $(triples "$1"); do get_target "$triple" || return 1; done
}

# Paths of this machine must not get into the binaries, so that builds in other folders give the same
# bytes. Arguments: further flags of rustc. Sets $flags, separated as CARGO_ENCODED_RUSTFLAGS wants.
set_flags() {
    local flag
    flags="--remap-path-prefix=$root=/source"$'\x1f'"--remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=/cargo"
    # Build scripts write code there. Usually it is below the first of these folders.
    if [[ $target/ != "$root/"* ]]; then set -- "--remap-path-prefix=$target=/source/target" "$@"; fi
    for flag in "$@"; do flags+=$'\x1f'"$flag"; done
}

# The stubs of macOS's libraries that ziglang brings, laid out as Apple's linker expects them. Its
# linker exports every symbol of a Rust library, hence rust-lld, which comes with Rust.
need_macos_sdk() {
    macos_sdk="$target/zig/macos-sdk"
    local zig lib="$macos_sdk/usr/lib"
    zig="$("$python" -c 'import os, ziglang; print(os.path.dirname(ziglang.__file__))')"
    mkdir -p "$lib"
    # Symbols for arm64e are there for arm64, too.
    sed 's/arm64e\(\.x1\)\?-/arm64-/g' "$zig/lib/libc/darwin/libSystem.tbd" >"$lib/libSystem.tbd"
    cp "$zig/lib/libc/darwin/SDKSettings.json" "$macos_sdk/"
    cp "$lib/libSystem.tbd" "$lib/libc.tbd"
    cp "$lib/libSystem.tbd" "$lib/libm.tbd"
    # The standard library names it and does not use it: -dead_strip_dylibs takes it out again.
    cat >"$lib/libiconv.tbd" <<'END'
--- !tapi-tbd
tbd-version: 4
targets: [ x86_64-macos, arm64-macos ]
install-name: '/usr/lib/libiconv.2.dylib'
...
END
    # A dependency of the orchestrator can ask for the time zone by these functions.
    local framework="$macos_sdk/System/Library/Frameworks/CoreFoundation.framework"
    mkdir -p "$framework"
    cat >"$framework/CoreFoundation.tbd" <<'END'
--- !tapi-tbd
tbd-version: 4
targets: [ x86_64-macos, arm64-macos ]
install-name: '/System/Library/Frameworks/CoreFoundation.framework/Versions/A/CoreFoundation'
exports:
  - targets: [ x86_64-macos, arm64-macos ]
    symbols: [ _CFRelease, _CFStringGetBytes, _CFStringGetCStringPtr, _CFStringGetLength,
               _CFTimeZoneCopySystem, _CFTimeZoneGetName, _CFTimeZoneResetSystem ]
...
END
    apple_linker="$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/host: //p')/bin/rust-lld"
}

# cargo build for the triple $1 with the further arguments.
cross_build() (
    local triple="$1"
    need_target "$triple"
    case "$triple" in
    *-apple-darwin)
        need_macos_sdk
        # Without a name of its own, a library is named by the path that it was built at.
        set_flags -Clinker="$apple_linker" -Clinker-flavor=ld64.lld -Clink-arg=-dead_strip_dylibs \
            -Clink-arg=-install_name -Clink-arg=@rpath/fmu.dylib
        # Dependencies in C are compiled by zig.
        local cc="$target/zig/cc-$triple"
        printf '#!/bin/sh\nPATH="%s:$PATH" exec cargo-zigbuild zig cc -- -target %s "$@"\n' \
            "$target/zig/bin" "${triple/apple-darwin/macos.$macos}" >"$cc"
        chmod +x "$cc"
        env "CC_${triple//-/_}=$cc" "CFLAGS_${triple//-/_}=-g0" \
            SDKROOT="$macos_sdk" MACOSX_DEPLOYMENT_TARGET="$macos" CARGO_ENCODED_RUSTFLAGS="$flags" \
            cargo build --locked --target "$triple" "${@:2}"
        ;;
    *)
        local versioned="$triple"
        case "$triple" in
        *-linux-gnu) set_flags; versioned="$triple.$glibc" ;;
        # Zig's linker keeps unused code unless it is told to strip the file.
        *-windows-gnullvm) set_flags -Clink-arg=-s ;;
        esac
        PATH="$target/zig/bin:$PATH" CARGO_ENCODED_RUSTFLAGS="$flags" \
            cargo zigbuild --locked --target "$versioned" "${@:2}"
        ;;
    esac
)

# Target of browsers. rustup has the standard library for it; else Debian's Rust builds it from its
# sources, for which it takes the place of the Rust that everything else is built with.
wasm=wasm32-unknown-unknown
debian=/usr/bin

debian_can_build() {
    [[ -x $debian/rustc && -x $debian/cargo ]] &&
        [[ -d $("$debian/rustc" --print sysroot)/lib/rustlib/src/rust/library ]]
}

can_build_browser() { get_target "$wasm" || debian_can_build; }

# Builds the WebAssembly module of the page for browsers.
browser_build() {
    local rust=() build=(build --locked --release --target "$wasm" --package reentry-browser)
    fetch
    set_flags
    if ! get_target "$wasm"; then
        say "Building Rust's standard library for $wasm with Debian's Rust"
        # Debian's Rust has no linker for WebAssembly; that of rustup has.
        local lld
        lld="$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/host: //p')/bin"
        rust=(env RUSTC="$debian/rustc" RUSTC_BOOTSTRAP=1 PATH="$lld:$PATH" "$debian/cargo")
        build+=(-Zbuild-std=std,panic_abort)
    else
        rust=(cargo)
    fi
    CARGO_ENCODED_RUSTFLAGS="$flags" "${rust[@]}" "${build[@]}"
}

# Needs of every build for another platform.
need_cross() {
    need_rust
    fetch
    need_venv "$target/zig" scripts/requirements/package.txt
}

# The folder with the built libraries of the platform $1.
built() {
    local names
    read -ra names <<<"$(triples "$1")"
    if [[ ${#names[@]} -gt 1 ]]; then echo "$target/$1/release"; else echo "$target/${names[0]}/release"; fi
}

# Builds the FMU libraries for the platform $1.
build_libraries() {
    say "Building the FMUs for $1"
    local triple name packages=()
    for name in "${fmu_libraries[@]}"; do packages+=(--package "reentry-${name//_/-}"); done
    for triple in $(triples "$1"); do cross_build "$triple" --release "${packages[@]}"; done
    if [[ $1 != macos-universal ]]; then return; fi
    for name in "${fmu_libraries[@]}"; do join "lib$name.dylib" release; done
}

# Builds the orchestrator for the platform $1 and puts it into the platform's folder.
build_program() {
    say "Building the orchestrator for $1"
    local triple name=orchestrator
    if [[ $1 == windows-* ]]; then name+=.exe; fi
    for triple in $(triples "$1"); do
        cross_build "$triple" --profile program --package orchestrator --bin orchestrator
    done
    if [[ $1 == macos-universal ]]; then join "$name" program; fi
    mkdir -p "$dist/$1"
    cp "$(dirname "$(built "$1")")/program/$name" "$dist/$1/"
}

# Joins the file $1 of the profile $2 for both processors of macOS.
join() {
    local triple inputs=()
    for triple in $(triples macos-universal); do inputs+=("$target/$triple/$2/$1"); done
    "$python" scripts/packaging/universal.py "$target/macos-universal/$2/$1" "${inputs[@]}"
}

# Builds and packs the FMUs for the given platforms, each by itself; those for Linux, Windows and
# macOS also together, as FMI 2.0 has a name for each of these.
package_fmus() {
    local platform also host
    # A wheel with archives that are not compressed as well as they can be is larger than 25 MB.
    local -x FMU_PACK_SMALL=1
    host="$(built linux-x86_64)"
    need_cross
    # The descriptions come from the library that this machine can open.
    build_libraries linux-x86_64
    build --bin fmu-pack
    for platform in "$@"; do
        if [[ $platform == linux-x86_64 ]]; then
            also=()
            pack_fmus "$host" "$dist/$platform/fmu"
        else
            build_libraries "$platform"
            also=("$(built "$platform")")
            pack_fmus "$host" "$dist/$platform/fmu" --only-also
        fi
        if [[ $platform == linux-aarch64 ]]; then
            # In the wheel each library stands once, where FMPy and the orchestrator look for it.
            pack_fmus "$host" "$dist/$platform/fmu-wheel" --only-also --folder linux64
        fi
    done
    also=("$(built windows-x86_64)" "$(built macos-universal)")
    if [[ " $* " == *" windows-x86_64 "* && " $* " == *" macos-universal "* ]]; then
        pack_fmus "$host" "$dist/all/fmu"
    fi
}
