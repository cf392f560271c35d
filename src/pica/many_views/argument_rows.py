"""Slang files whose parameters are rows of a buffer, made from the files as they are: one dispatch serves many views.

What a shader is given stands at the top of its file, as `Texture2D<float4> normals;`. In the files that are made here
it becomes a variable and a property of the same name, so that no other line changes:

    static DescriptorHandle<Texture2D<float4>> normalsToRead;
    property Texture2D<float4> normals { get { return *nonuniform(normalsToRead); } }

An entry point first fills all these variables from the row of its view. Structured buffers become pointers; parameter
blocks of a view become static variables, of which each view has a row too. What all views share stays as it is.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

VIEW_BLOCKS = frozenset({"frame", "gbuffer", "reprojection", "radianceCache", "surfels"})
"""Parameter blocks of which each view has its own. The others belong to the scene."""
ROWS, PLACE, OF_BLOCK, OF_FILE = "argumentRows", "argumentPlace", "Rows", "of"
"""Parameters of each entry point: the rows; the first row of the dispatch, and the groups of a view along z; and what
the names of rows of blocks end in, and those of files' parts of a row begin with."""
READ, WRITTEN = "ToRead", "ToWrite"
"""What the names of handles end in."""
_TYPED_BY_SCENE = "shaders/environment.slang"
"""Its functions take structured buffers of the scene's block, which stay such."""
_KEYWORDS = (
    "static|import|__exported|module|struct|typealias|groupshared|extern|return|implementing|enum|func|let|var|property"
    "|interface|extension|namespace|using|__include|__generic|associatedtype"
)
_DECLARATION = re.compile(
    rf"\s*(?P<public>public\s+)?(?:uniform\s+)?(?!(?:{_KEYWORDS})\b)"
    r"(?P<type>[A-Za-z_][\w.]*(?:<(?P<of>[^;()]*)>)?)\s+(?P<names>\w+(?:\[\w+\])?(?:\s*,\s*\w+)*)\s*;"
)
_SHARED = {"RaytracingAccelerationStructure", "SamplerState", "ByteAddressBuffer", "RWByteAddressBuffer"}
_HANDLED = re.compile(r"(?:RW)?(?:Texture2D|Texture2DArray|Texture3D|TextureCube|Buffer)\b")
_STRUCTURED = re.compile(r"(?:RW)?StructuredBuffer\b")
_BUFFER_PARAMETER = re.compile(r"(?<=[(,])(\s*)(?:RW)?StructuredBuffer<((?:[^<>]|<[^<>]*>)*)>(?=\s+\w+\s*[,)])")
_STRUCT = re.compile(r"\bstruct\s+(\w+)[^{;]*\{")
_ENTRY = re.compile(r'\[shader\("(compute|raygeneration)"\)\][^;{]*?\bvoid\s+\w+\s*\((?P<given>[^{]*?)\)\s*\{')
_NUMBERED = re.compile(r"\buint3\s+(\w+)\s*:\s*(SV_DispatchThreadID|SV_GroupID)\b")
IMPORT = re.compile(r"^[ \t]*(?:(?:__exported[ \t]+)?import|__include)[ \t]+([\w.]+)[ \t]*;", re.MULTILINE)


@dataclass(frozen=True)
class _Parameter:
    """A declaration at the top of a file, or a field of a block."""

    start: int
    end: int
    public: str
    type: str
    of: str
    name: str
    count: str
    """With brackets, of an array."""

    @property
    def is_handled(self) -> bool:
        return _HANDLED.match(self.type) is not None

    @property
    def is_structured(self) -> bool:
        return _STRUCTURED.match(self.type) is not None

    @property
    def is_shared(self) -> bool:
        """Stays a parameter."""
        return self.type in _SHARED or self.type.startswith("ParameterBlock<")

    @property
    def view_block(self) -> bool:
        return self.type.startswith("ParameterBlock<") and self.name in VIEW_BLOCKS

    @property
    def field(self) -> str:
        """In a row."""
        stored = f"DescriptorHandle<{self.type}>" if self.is_handled else self.type
        return f"{'uint64_t' if self.is_structured else stored} {self.stored}{self.count};"

    @property
    def stored(self) -> str:
        """The name of its field: that of a handle ends in what is done with it."""
        return self.name + (WRITTEN if self.type.startswith("RW") else READ) if self.is_handled else self.name

    def declared(self, static: str) -> str:
        """In place of the declaration: a variable, and a property for what it refers to."""
        public, name = self.public, self.name
        if self.is_structured:
            return f"{public}{static}{self.of}* {name};"
        if not self.is_handled:
            return f"{public}{static}{self.type} {name}{self.count};"
        handle = f"DescriptorHandle<{self.type}>"
        if self.count:
            kind = f"{name[0].upper()}{name[1:]}Handles"
            get = f"public __subscript(int number) -> {self.type} {{ get {{ return *nonuniform(of[number]); }} }}"
            return f"public struct {kind} {{ public {handle} of{self.count}; {get} }}; {public}{static}{kind} {name};"
        return (
            f"{public}{static}{handle} {self.stored}; "
            f"{public}property {self.type} {name} {{ get {{ return *nonuniform({self.stored}); }} }}"
        )

    @property
    def taken(self) -> str:
        """The statement that fills the variable."""
        if self.is_structured:
            return f"{self.name} = ({self.of}*)row.{self.name};"
        return f"{f'{self.name}.of' if self.count and self.is_handled else self.stored} = row.{self.stored};"


def package_with_rows(package: Path, folder: Path) -> None:
    """Write all Slang files of the package into `folder`, with rows."""
    texts = {str(path.relative_to(package).as_posix()): path.read_text() for path in package.rglob("*.slang")}
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(_with_rows(name, text, texts))


def entry_with_rows(text: str, files: dict[str, str], more: str | None = None) -> str:
    """The same for the text of an entry point; `files`: the package's, by their names. `more`: one of them, with
    implementations for `extern` declarations, whose parameters are in the row too."""
    return _with_rows("", text, files, more)


def _with_rows(name: str, text: str, files: dict[str, str], more: str | None = None) -> str:
    bare = _without_comments(text)
    given = _parameters(bare)
    changes: list[tuple[int, int, str]] = []
    for start, end, group in _grouped(given):
        if group[0].view_block:
            changes.append((start, end, _block_in_rows(group[0], bare, changes)))
        elif not group[0].is_shared:
            changes.append((start, end, " ".join(each.declared("static ") for each in group)))
    if name != _TYPED_BY_SCENE:
        changes += [(m.start(), m.end(), f"{m[1]}{m[2]}*") for m in _BUFFER_PARAMETER.finditer(bare)]
    after = _taking(name, bare)
    for entry in _ENTRY.finditer(bare):
        before, first = _entry(entry, bare)
        changes.append((entry.start("given"), entry.end("given"), before))
        changes.append((entry.end(), entry.end(), first))
    if _ENTRY.search(bare):
        after += _arguments(name, bare, files, more)
    for start, end, new in sorted(changes, reverse=True):
        text = text[:start] + new + text[end:]
    text += after
    # In a file that says nothing of visibility, Slang makes all public.
    return text if re.search(r"\bpublic\b", bare) else re.sub(r"\bpublic ", "", text)


def _block_in_rows(block: _Parameter, bare: str, changes: list[tuple[int, int, str]]) -> str:
    """In place of a view's block; its struct's resources are handles too."""
    for struct in _STRUCT.finditer(bare):
        if struct[1] == block.of:
            for start, end, group in _grouped(_parameters(bare, struct.end())):
                if group[0].is_handled or group[0].is_structured:
                    changes.append((start, end, " ".join(each.declared("") for each in group)))
    return f"public static {block.of} {block.name}; public StructuredBuffer<{block.of}> {block.name}{OF_BLOCK};"


def _taking(name: str, bare: str) -> str:
    """The struct of a file's row, and the function that takes its parameters from one."""
    token, taken = _token(name), [each for each in _parameters(bare) if not each.is_shared]
    blocks = [each.name for each in _parameters(bare) if each.view_block]
    text = ""
    if taken:
        fields = " ".join(f"public {each.field}" for each in taken)
        text += f"\npublic struct Row{token} {{ {fields} }}"
    if taken or blocks:
        row = f"Row{token} row, " if taken else ""
        steps = [each.taken for each in taken] + [f"{block} = {block}{OF_BLOCK}[view];" for block in blocks]
        text += f"\npublic void take{token}({row}uint view) {{ {' '.join(steps)} }}\n"
    return text


def _arguments(name: str, bare: str, files: dict[str, str], more: str | None) -> str:
    """The row of an entry point's file: those of all files with parameters that it imports."""
    imports, fields, steps = "", [], []
    for path in ["", *sorted(_imported(bare, files, more) - {name})]:
        content = bare if path == "" else _without_comments(files[path])
        given = _parameters(content)
        token = _token(path or name)
        own = any(not each.is_shared for each in given)
        if own or any(each.view_block for each in given):
            if path:
                imports += f"import {path.removesuffix('.slang').replace('/', '.')};\n"
            if own:
                fields.append(f"Row{token} {OF_FILE}{token};")
            steps.append(f"take{token}({f'row.{OF_FILE}{token}, ' if own else ''}view);")
    fields = fields or ["uint unused;"]
    imports += "import tracing.view_number;\n"
    return (
        f"{imports}struct ArgumentRow {{ {' '.join(fields)} }}\n"
        f"StructuredBuffer<ArgumentRow> {ROWS};\nuniform uint2 {PLACE};\n"
        f"void takeArguments(uint view) {{ ArgumentRow row = {ROWS}[view]; {' '.join(steps)} }}\n"
    )


def _entry(entry: re.Match[str], bare: str) -> tuple[str, str]:
    """Its parameters, and its first statements."""
    given = entry["given"]
    if entry[1] == "raygeneration":
        return given, f" viewNumber = {PLACE}.x + DispatchRaysIndex().z; takeArguments(viewNumber);"
    groups = re.search(r"numthreads\(\s*\w+\s*,\s*\w+\s*,\s*1\s*\)", entry[0])
    assert groups, f"an entry point with several threads along z: {entry[0]}"
    numbered = _NUMBERED.findall(given)
    first = " ".join(f"{number}.z %= {PLACE}.y;" for number, _ in numbered)
    if not numbered:
        given = f"{given}, uint3 viewGroup : SV_GroupID" if given.strip() else "uint3 viewGroup : SV_GroupID"
    by = numbered[0][0] if numbered else "viewGroup"
    return given, f" takeArguments({PLACE}.x + {by}.z / {PLACE}.y); {first}"


def _imported(bare: str, files: dict[str, str], more: str | None) -> set[str]:
    """All files of the package that a text imports, and that `more` does, with itself."""
    waiting, seen = IMPORT.findall(bare), set[str]()
    if more is not None:
        waiting.append(more.removesuffix(".slang").replace("/", "."))
    while waiting:
        path = f"{waiting.pop().replace('.', '/')}.slang"
        if path not in seen and path in files:
            seen.add(path)
            waiting += IMPORT.findall(_without_comments(files[path]))
    return seen


def _token(name: str) -> str:
    return "".join(part[0].upper() + part[1:] for part in re.split(r"\W|_", name.removesuffix(".slang")) if part)


def _without_comments(text: str) -> str:
    """With spaces in their place, so that all else stays where it is."""
    return re.sub(r"//[^\n]*|/\*.*?\*/", lambda found: re.sub(r"[^\n]", " ", found[0]), text, flags=re.DOTALL)


def _parameters(bare: str, start: int = 0) -> list[_Parameter]:
    """Declarations outside of all braces; from `start` on, those of a struct that is open there."""
    found = []
    for first, end in _statements(bare, start):
        declared = _DECLARATION.fullmatch(bare, first, end)
        if declared is None:
            continue
        first = declared.start("public") if declared["public"] else declared.start("type")
        first -= len("uniform ") if bare[:first].endswith("uniform ") else 0
        for name in re.split(r"\s*,\s*", declared["names"]):
            bracket = name.find("[")
            count = name[bracket:] if bracket >= 0 else ""
            plain = name[:bracket] if bracket >= 0 else name
            public = "public " if declared["public"] else ""
            found.append(_Parameter(first, end, public, declared["type"], declared["of"] or "", plain, count))
    return found


def _statements(bare: str, start: int) -> Iterator[tuple[int, int]]:
    """Begin and end of each statement at the depth of `start` that ends with a semicolon."""
    depth, first = 0, start
    for place in range(start, len(bare)):
        letter = bare[place]
        if letter in "{(":
            depth += 1
        elif letter in "})":
            depth -= 1
            if depth < 0:
                return
            if depth == 0 and letter == "}":
                first = place + 1
        elif letter == ";" and depth == 0:
            yield first, place + 1
            first = place + 1


def _grouped(given: Iterable[_Parameter]) -> Iterator[tuple[int, int, list[_Parameter]]]:
    """Those of one statement together."""
    groups: dict[tuple[int, int], list[_Parameter]] = {}
    for each in given:
        groups.setdefault((each.start, each.end), []).append(each)
    for (start, end), group in groups.items():
        yield start, end, group
