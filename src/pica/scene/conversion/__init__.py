"""Reading files of other formats than glTF: a process with limits converts them to it.

Their libraries parse forged files without limits on time and memory (docs/guide/security.md). So they run in a
process of its own, which writes binary glTF, and what it wrote is read with the checks of any glTF file.
"""
