# SPDX-License-Identifier: Apache-2.0
"""Archives whose bits depend on nothing but their content, which is given as {name: (bytes, mode)}."""
import gzip
import io
import tarfile
import zipfile


def write_tar(path, files, epoch):
    """Writes a .tar.gz; `epoch`: time of all files, in seconds since 1970."""
    plain = io.BytesIO()
    with tarfile.open(fileobj=plain, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for name in sorted(files):
            content, mode = files[name]
            info = tarfile.TarInfo(name)
            info.size, info.mode, info.mtime = len(content), mode, epoch
            archive.addfile(info, io.BytesIO(content))
    path.write_bytes(gzip.compress(plain.getvalue(), 9, mtime=0))


def write_zip(path, files):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            content, mode = files[name]
            info = zipfile.ZipInfo(name)  # without a given date, ZipInfo dates each file 1980-01-01
            info.external_attr = (0o100000 | mode) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, content)
