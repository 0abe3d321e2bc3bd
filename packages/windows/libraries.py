#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Builds the libraries of absenc.exe that Debian does not package for mingw, from Debian's source packages. Each gets a
folder in ~/.cache/absenc/windows, which later runs use again. Prints these folders."""
import glob
import hashlib
import inspect
import os
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
sys.path.insert(0, os.path.join(ROOT, "tests"))
from wine_support import WINE, Prefix  # in tests/

HOST = "x86_64-w64-mingw32"
CC = f"{HOST}-gcc-posix"
CMAKE = ["cmake", "-G", "Ninja", "-D", "CMAKE_BUILD_TYPE=Release", "-D", "BUILD_SHARED_LIBS=OFF",
         "-D", f"CMAKE_TOOLCHAIN_FILE={ROOT}/cmake/x86_64-w64-mingw32.cmake"]
# Windows 10, as in cmake/windows.cmake; code of other libraries is small rather than fast.
FLAGS = ["-Os", "-D_WIN32_WINNT=0x0A00"]
CACHE = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "absenc", "windows")


def run(*command, folder, **settings):
    print("+", *command, file=sys.stderr, flush=True)
    subprocess.run(command, cwd=folder, check=True, stdin=subprocess.DEVNULL, stdout=sys.stderr, stderr=sys.stderr,
                   **settings)


def make(*words, folder):
    run("make", f"-j{os.cpu_count()}", *words, folder=folder)


def compile_archive(name, sources, prefix, *, flags, folder):
    """Compiles `sources` into lib<name>.a of `prefix`."""
    for source in sources:
        run(CC, *FLAGS, *flags, "-c", source, folder=folder)
    os.makedirs(f"{prefix}/lib", exist_ok=True)
    objects = [os.path.splitext(os.path.basename(source))[0] + ".o" for source in sources]
    run(f"{HOST}-ar", "rcs", f"{prefix}/lib/lib{name}.a", *objects, folder=folder)


def copy_headers(headers, folder):
    os.makedirs(folder, exist_ok=True)
    for header in headers:
        shutil.copy(header, folder)


# Each function builds one library: from its sources, in the working folder, into `prefix`.

def build_libdeflate(source, prefix):
    make(f"CC={CC}", f"AR={HOST}-ar", "CFLAGS=" + " ".join(FLAGS), "libdeflatestatic.lib", folder=source)
    os.makedirs(f"{prefix}/lib")
    shutil.copy(f"{source}/libdeflatestatic.lib", f"{prefix}/lib/libdeflate.a")
    copy_headers([f"{source}/libdeflate.h"], f"{prefix}/include")


def build_minizip(source, prefix):  # only its writer; zlib is in Debian's libz-mingw-w64-dev
    compile_archive("minizip", ["zip.c", "ioapi.c"], prefix, flags=[], folder=source)
    copy_headers([f"{source}/zip.h", f"{source}/ioapi.h"], f"{prefix}/include/minizip")


def build_sqlite(source, prefix):
    run("./configure", folder=source)
    make("sqlite3.c", folder=source)  # all of it in one file
    compile_archive("sqlite3", ["sqlite3.c"], prefix, folder=source,
                    flags=["-DSQLITE_OMIT_LOAD_EXTENSION", "-DSQLITE_DEFAULT_MEMSTATUS=0", "-DSQLITE_THREADSAFE=1"])
    copy_headers([f"{source}/sqlite3.h"], f"{prefix}/include")


def build_libmicrohttpd(source, prefix):
    run("./configure", f"--host={HOST}", f"CC={CC}", "CFLAGS=" + " ".join(FLAGS), f"--prefix={prefix}",
        "--disable-shared", "--enable-static", "--disable-https", "--disable-doc", "--disable-examples",
        "--disable-curl", "--disable-dauth", "--disable-bauth", "--disable-postprocessor", "--disable-httpupgrade",
        folder=source)
    make("-C", "src/microhttpd", "install", folder=source)
    make("-C", "src/include", "install", folder=source)


def build_mosquitto(source, prefix):  # only the library for clients; without TLS, which would need OpenSSL
    run(*CMAKE, "-B", "build", "-D", f"CMAKE_INSTALL_PREFIX={prefix}", "-D", "CMAKE_C_FLAGS=" + " ".join(FLAGS),
        *(word for option in ("TLS", "THREADING", "BROKER", "APPS", "PLUGINS", "CLIENTS", "LIB_CPP", "CJSON")
          for word in ("-D", f"WITH_{option}=OFF")), "-D", "DOCUMENTATION=OFF", "-D", "WITH_STATIC_LIBRARIES=ON",
        folder=source)
    run("ninja", "-C", "build", "libmosquitto_static", folder=source)
    os.makedirs(f"{prefix}/lib")
    [archive] = glob.glob(f"{source}/build/lib/libmosquitto*.a")
    shutil.copy(archive, f"{prefix}/lib/libmosquitto.a")
    copy_headers([f"{source}/include/mosquitto.h", f"{source}/include/mqtt_protocol.h"], f"{prefix}/include")


def build_hdf5(source, prefix):  # only the library for C; programs that its build runs are for Windows, too
    build = f"{source}/build"  # these programs write into the folder in which CMake runs
    os.makedirs(build)
    with Prefix() as wine:
        # no paths and dates of this build in the library, so that each build gives the same bits
        flags = [*FLAGS, f"-fmacro-prefix-map={source}/="]
        run(*CMAKE, "-S", source, "-B", build, "-D", "CMAKE_C_FLAGS=" + " ".join(flags), "-D",
            "HDF5_ENABLE_EMBEDDED_LIBINFO=OFF", "-D",
            f"CMAKE_CROSSCOMPILING_EMULATOR={WINE}", "-D", "H5_HAVE_UNISTD_H=0",  # where it is, HDF5 wants sys/wait.h
            "-D", "BUILD_TESTING=OFF",
            *(word for part in ("TOOLS", "EXAMPLES", "CPP_LIB", "HL_LIB") for word in ("-D", f"HDF5_BUILD_{part}=OFF")),
            *(word for part in ("Z_LIB", "SZIP") for word in ("-D", f"HDF5_ENABLE_{part}_SUPPORT=OFF")),
            folder=build, env=wine.environment)
        run("ninja", "-C", build, "hdf5-static", folder=build, env=wine.environment)
    os.makedirs(f"{prefix}/lib")
    shutil.copy(f"{build}/bin/libhdf5.a", f"{prefix}/lib")
    copy_headers([*glob.glob(f"{source}/src/H5*pub*.h"), *glob.glob(f"{source}/src/H5FD*.h"),
                  *(f"{source}/src/{name}.h" for name in ("hdf5", "H5version", "H5api_adpt", "H5overflow")),
                  *glob.glob(f"{build}/src/H5*pub*.h")], f"{prefix}/include")


def build_ncurses(source, prefix):  # only the basic library, whose driver calls the functions of Windows' console
    build = f"{source}/build"
    os.makedirs(build)
    run("../configure", f"--host={HOST}", "--build=x86_64-linux-gnu", f"CC={CC}", "CFLAGS=" + " ".join(FLAGS),
        "--with-build-cc=gcc", "--enable-widec", "--enable-term-driver", "--enable-sp-funcs", "--without-shared",
        "--with-normal", "--disable-home-terminfo", "--disable-echo",
        *(f"--without-{part}" for part in ("debug", "ada", "cxx", "cxx-binding", "tests", "progs", "manpages", "dlsym")),
        folder=build)
    make("-C", "include", folder=build)
    make("-C", "ncurses", folder=build)
    os.makedirs(f"{prefix}/lib")
    shutil.copy(f"{build}/lib/libncursesw.a", f"{prefix}/lib")
    copy_headers([f"{build}/include/{name}.h" for name in ("curses", "ncurses_dll", "unctrl")], f"{prefix}/include")


# Name and version of the source package, and what builds it. A change of either builds it anew.
LIBRARIES = [
    ("libdeflate", "1.14-1", build_libdeflate),
    ("minizip", "1.1-8+deb12u1", build_minizip),
    ("sqlite3", "3.40.1-2+deb12u2", build_sqlite),
    ("libmicrohttpd", "0.9.75-6", build_libmicrohttpd),
    ("mosquitto", "2.0.11-1.2+deb12u2", build_mosquitto),
    ("hdf5", "1.10.8+repack1-1", build_hdf5),
    ("ncurses", "6.4-4", build_ncurses),
]


def folder_of(name, version, build):
    digest = hashlib.sha256(repr((FLAGS, inspect.getsource(build))).encode()).hexdigest()[:8]
    return os.path.join(CACHE, f"{name}-{version}-{digest}")


def ask_apt(folder):
    """Returns the beginning of command lines of apt-get that know source packages, from where this computer has its
    packages. All that apt keeps for it is in `folder`: /etc/apt stays as it is."""
    listed = subprocess.run(["apt-get", "indextargets", "--format", "deb-src $(REPO_URI) $(RELEASE) $(COMPONENT)",
                             "Created-By: Packages", "Origin: Debian"], check=True, capture_output=True,
                            encoding="utf-8").stdout
    if not listed:
        sys.exit("apt knows no packages of Debian, from whose sources the libraries are built: run apt-get update")
    for name in ("lists/partial", "cache/archives/partial"):
        os.makedirs(os.path.join(folder, name))
    with open(os.path.join(folder, "sources.list"), "w", encoding="utf-8") as file:
        file.write("".join(sorted(set(listed.splitlines(keepends=True)))))
    with open(os.path.join(folder, "apt.conf"), "w", encoding="utf-8") as file:
        file.write(f'Dir::Etc::sourcelist "{folder}/sources.list";\nDir::Etc::sourceparts "/dev/null";\n'
                   f'Dir::State::lists "{folder}/lists";\nDir::Cache "{folder}/cache";\nAPT::Sandbox::User "";\n'
                   "#clear APT::Update;\n")
    apt = ["apt-get", "-q", "-c", f"{folder}/apt.conf"]
    run(*apt, "update", folder=folder)
    return apt


def build_missing(missing):
    with tempfile.TemporaryDirectory(prefix="absenc-libraries-") as work:
        apt_folder = os.path.join(work, "apt")
        os.makedirs(apt_folder)
        apt = ask_apt(apt_folder)
        for name, version, build in missing:
            folder = os.path.join(work, name)
            os.makedirs(folder)
            try:  # apt checks the signature of the list of packages, which has the checksums of the sources
                run(*apt, "source", f"{name}={version}", folder=folder)
            except subprocess.CalledProcessError:
                sys.exit(f"the sources of {name} {version} are not there: if Debian has another version now, write it "
                         f"into {__file__}")
            [source] = [entry.path for entry in os.scandir(folder) if entry.is_dir()]
            final = folder_of(name, version, build)
            prefix = os.path.join(work, "prefix", os.path.basename(final))
            os.makedirs(prefix)
            build(source, prefix)
            shutil.copy(f"{source}/debian/copyright", prefix)
            os.makedirs(CACHE, exist_ok=True)
            shutil.move(prefix, f"{final}.{os.getpid()}")  # appears at once, and only when it is whole
            try:
                os.rename(f"{final}.{os.getpid()}", final)
            except OSError:  # another run was faster
                shutil.rmtree(f"{final}.{os.getpid()}")


def folders():
    """Returns the folders of all libraries; builds those that are not there."""
    missing = [library for library in LIBRARIES if not os.path.isdir(folder_of(*library))]
    if missing:
        build_missing(missing)
    return [folder_of(*library) for library in LIBRARIES]


if __name__ == "__main__":
    print("\n".join(folders()))
