# SPDX-License-Identifier: Apache-2.0
"""Builds the image that the virtual machine boots: Debian's kernel and an initramfs."""
import contextlib
import glob
import importlib.util
import modulefinder
import os
import platform
import re
import shutil
import subprocess
import sys
import zlib

TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CACHE = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "absenc")

# The kernel for the virtual machine is Debian's: a container cannot add modules to the kernel on which it runs.

# Kernel modules for the tests, including those that the kernel itself loads on demand.
MODULES = ["can", "can-raw", "vcan", "slcan", "fuse", "cuse", "dummy_hcd", "cdc-acm", "usb_f_acm", "usb_f_serial",
           "usb_f_obex", "g_serial", "usb_f_fs", "ftdi_sio"]
# Programs of this computer that are copied into the initramfs.
PROGRAMS = ["candump", "cangen", "cansend", "flashrom", "ip", "slcand", "spi-config", "spi-pipe"]
PACKAGES = "/usr/lib/python3/dist-packages"  # where Debian's packages install modules
TOOLS = ["apt-cache", "apt-get", "dpkg-deb", "tar", "xz", "modinfo", "ldd", "busybox", "cpio", "qemu-system-x86_64"]


class Missing(Exception):
    """An exception whose text is the reason why the machine cannot be built on this computer."""


def output_of(*command):
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except FileNotFoundError:
        raise Missing(f"there is no {command[0]} here") from None
    except subprocess.CalledProcessError as error:
        raise Missing(f"{' '.join(command)}: {error.stderr.strip()}") from None


def program(name):
    path = shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")
    if path is None:
        raise Missing(f"there is no {name} here")
    return path


def kernel_package():
    """Returns Debian's current kernel package; without a server, the newest one of the cache."""
    if platform.machine() != "x86_64":
        raise Missing(f"the machine is x86_64, the programs of this computer are {platform.machine()}")
    os.makedirs(CACHE, exist_ok=True)
    try:
        # linux-image-amd64 is an empty package that depends on the kernel.
        name = field_of("linux-image-amd64", r"Depends:.*?(linux-image-[0-9][^ ,]*)")
        version = field_of(name, r"Version: (.*)").replace(":", "%3a")
        path = os.path.join(CACHE, f"{name}_{version}_amd64.deb")
        if not os.path.exists(path):
            download(name, path)
        return path
    except Missing:
        cached = sorted(glob.glob(os.path.join(CACHE, "linux-image-*_amd64.deb")), key=os.path.getmtime)
        if not cached:
            raise
        return cached[-1]


def field_of(package, pattern):
    found = re.search(f"^{pattern}", output_of("apt-cache", "show", "--no-all-versions", package), re.MULTILINE)
    if found is None:
        raise Missing(f"apt does not know {package} as it should: apt-get update")
    return found[1]


def download(package, path):
    """Downloads the package to `path`, and deletes the other kernels from the cache."""
    former = [old for old in glob.glob(os.path.join(CACHE, "linux-image-*"))
              if re.search(r"_amd64\.(deb|[0-9a-f]{8})$", old) and old != path]
    with own_folder(path) as folder:
        try:
            command = ["apt-get", "-q", "download", package]
            subprocess.run(command, check=True, cwd=folder, capture_output=True, text=True)
        except subprocess.CalledProcessError as error:
            raise Missing(f"apt-get download {package}: {error.stderr.strip()} (perhaps apt-get update)") from None
        os.rename(glob.glob(os.path.join(folder, "*.deb"))[0], path)
    for old in former:
        shutil.rmtree(old, ignore_errors=True)
        with contextlib.suppress(OSError):
            os.remove(old)


@contextlib.contextmanager
def own_folder(path):
    """Context with a new folder beside `path`, which is deleted at the end."""
    folder = f"{path}.{os.getpid()}"
    os.makedirs(folder)
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def unpacked_kernel():
    """Returns a folder with vmlinuz, modules as NAME.ko, and `order`, in which they are loaded."""
    package = kernel_package()
    folder = f"{package.removesuffix('.deb')}.{zlib.crc32(' '.join(MODULES).encode()):08x}"
    if os.path.exists(folder):
        return folder
    with own_folder(folder) as mine:
        whole = make(os.path.join(mine, "whole"))
        chosen = make(os.path.join(mine, "chosen"))
        with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", package], stdout=subprocess.PIPE) as archive:
            subprocess.run(["tar", "-x", "-C", whole, "--wildcards", "./boot/vmlinuz-*", "./lib/modules/*/kernel/*"],
                           check=True, stdin=archive.stdout)
        found = {os.path.basename(path).split(".")[0].replace("-", "_"): path
                 for path in glob.glob(os.path.join(whole, "lib/modules/**/*.ko*"), recursive=True)}
        order = []
        for name in MODULES:
            add_module(name.replace("-", "_"), found, chosen, order)
        with open(os.path.join(chosen, "order"), "w", encoding="ascii") as file:
            file.write("".join(f"{name}\n" for name in order))
        os.rename(glob.glob(os.path.join(whole, "boot/vmlinuz-*"))[0], os.path.join(chosen, "vmlinuz"))
        if not os.path.exists(folder):  # another run may have created the folder meanwhile
            os.rename(chosen, folder)
    return folder


def add_module(name, found, folder, order):
    if name in order:
        return
    if name not in found:
        raise Missing(f"this kernel has no module {name}")
    path = os.path.join(folder, f"{name}.ko")
    if found[name].endswith(".xz"):
        with open(path, "wb") as file:
            subprocess.run(["xz", "-dc", found[name]], check=True, stdout=file)
    else:
        shutil.copyfile(found[name], path)
    for needed in output_of(program("modinfo"), "-F", "depends", path).strip().split(","):
        if needed:
            add_module(needed.replace("-", "_"), found, folder, order)
    order.append(name)


def make(folder):
    os.makedirs(folder, exist_ok=True)
    return folder


def libraries(path):
    """Returns the libraries that ldd finds for a program or a library."""
    result = subprocess.run(["ldd", path], capture_output=True, text=True)
    return re.findall(r"(?:=> |^\s+)(/\S+) \(0x", result.stdout, re.MULTILINE)


def python_files(scripts):
    """Returns the files of the interpreter and of what these scripts import."""
    finder = modulefinder.ModuleFinder(path=[os.path.join(TESTS, "vm"), TESTS, *sys.path[1:]])
    for script in scripts:
        finder.run_script(script)
    # Modules that the interpreter imports when it starts.
    for name in ("os", "encodings.utf_8", "encodings.ascii", "encodings.latin_1"):
        finder.import_hook(name)
    files = {module.__file__ for module in finder.modules.values() if module.__file__}
    files |= {importlib.util.cache_from_source(path) for path in files if path.endswith(".py")}
    return [sys.executable, *(path for path in files if os.path.exists(path))]


class Image:
    """An initramfs with programs and libraries at the same paths as on this computer."""

    def __init__(self, folder):
        self.root = make(folder)
        for name in ("bin", "dev", "modules", "proc", "sys", "tmp"):
            make(os.path.join(folder, name))

    def put(self, source, path):
        target = self.root + path
        make(os.path.dirname(target))
        if not os.path.exists(target):
            shutil.copy2(source, target)

    def put_text(self, path, text):
        make(os.path.dirname(self.root + path))
        with open(self.root + path, "w", encoding="utf-8") as file:
            file.write(text)

    def put_with_libraries(self, source, path=None):
        self.put(source, path or source)
        if source.endswith(".py") or source.endswith(".pyc"):
            return
        for library in libraries(source):
            self.put(library, library)

    def write(self, path):
        names = [os.path.relpath(os.path.join(folder, name), self.root)
                 for folder, folders, files in os.walk(self.root) for name in folders + files]
        with open(path, "wb") as file:
            subprocess.run(["cpio", "--quiet", "-o", "-H", "newc", "-R", "0:0"], check=True, cwd=self.root, stdout=file,
                           input="\n".join(names).encode())


def build(absenc, patterns, folder):
    """Writes the initramfs to `folder`. Returns the paths of the kernel and of the initramfs."""
    for name in PROGRAMS + TOOLS:
        program(name)
    kernel = unpacked_kernel()
    image = Image(os.path.join(folder, "root"))
    for path in glob.glob(os.path.join(kernel, "*.ko")) + [os.path.join(kernel, "order")]:
        image.put(path, "/modules/" + os.path.basename(path))
    image.put(program("busybox"), "/bin/busybox")
    image.put_with_libraries(absenc, "/bin/absenc")
    for name in ("can_emulation", "ftdi_device"):
        image.put_with_libraries(os.path.join(os.path.dirname(absenc), "../vm", name), f"/bin/{name}")
    for name in PROGRAMS:
        image.put_with_libraries(program(name), f"/bin/{name}")
    # Debian's Python module ftdi1, which ftdi_test.py imports: a Python file and a shared library
    for path in glob.glob(f"{PACKAGES}/*ftdi1*"):
        image.put_with_libraries(path)
    scripts = glob.glob(os.path.join(TESTS, "vm/*_test.py")) + [os.path.join(TESTS, "vm/guest.py")]
    for path in python_files(scripts):
        image.put_with_libraries(path, path.replace(TESTS, "/tests"))
    os.symlink(sys.executable, os.path.join(image.root, "bin/python3"))
    for script in scripts:
        image.put(script, script.replace(TESTS, "/tests"))
    image.put_text("/tests/patterns", " ".join(patterns))
    image.put_text("/pythonhome", f"{sys.base_prefix}:{sys.base_exec_prefix}")
    image.put(os.path.join(TESTS, "vm/init"), "/init")
    initramfs = os.path.join(folder, "initramfs")
    image.write(initramfs)
    return os.path.join(kernel, "vmlinuz"), initramfs
