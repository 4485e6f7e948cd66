"""Kernels as parts of others: kept as intermediate code, which becomes machine code only within what calls it.

On its own Numba optimises a function that another calls, makes machine code of it, and does both once more within the
caller; and so at each level of calls. A part is only lowered to LLVM's intermediate code. The kernel that Python calls
takes in all of its parts, and is optimised once, as a whole.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any

from llvmlite.binding import parse_bitcode
from numba import njit, types
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.sigutils import normalize_signature

__all__ = ["PartCacheImpl", "compile_entry", "part_dispatcher"]


class _PartLibrary(JITCodeLibrary):
    """Intermediate code with all that it calls, which is neither optimised as a whole nor made machine code."""

    def finalize(self) -> None:
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            if hasattr(self, "_reload_init"):  # not in Numba 0.61
                self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True

    def serialize_using_object_code(self) -> tuple[str, bytes]:
        self._ensure_finalized()
        return self.name, self._final_module.as_bitcode()

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, bytes]) -> _PartLibrary:
        library = cls(codegen, state[0])
        library._final_module = parse_bitcode(state[1])
        library._finalize_dynamic_globals()
        library._finalized = True
        return library


class _PartCompiler(Compiler):
    """Numba's compiler, which ends at intermediate code."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags.no_compile = True
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), "part")


class PartCacheImpl(CompileResultCacheImpl):
    """How a part is stored."""

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> CompileResult:
        """Make of what ``CompileResult._reduce`` has stored the same, without machine code."""
        code, fndesc, environment, signature, objectmode, lifted, annotation, reload_init, environments = payload
        for each in reload_init:
            each()
        return CompileResult(
            typing_context=target_context.typing_context,
            target_context=target_context,
            entry_point=None,
            typing_error=None,
            type_annotation=annotation,
            signature=signature,
            objectmode=objectmode,
            lifted=lifted,
            fndesc=fndesc,
            library=_PartLibrary._unserialize(target_context.codegen(), code),
            call_helper=None,
            environment=environment,
            metadata=None,
            reload_init=reload_init,
            referenced_envs=environments,
        )


def part_dispatcher(function: FunctionType, options: dict[str, Any]) -> Any:
    """Make a dispatcher of a function that other dispatchers' functions call, and not Python."""
    made = njit(pipeline_class=_PartCompiler, no_cpython_wrapper=True, **options)(function)
    made.compile = partial(_compile_part, made)
    made.get_call_template = partial(_part_template, made)
    return made


def _compile_part(made: Any, signature: Any) -> Any:
    """Put into a dispatcher what its callers need; in place of the dispatcher's own ``compile``."""
    with global_compiler_lock:
        own = tuple(normalize_signature(signature)[0])
        found = made.overloads.get(own)
        if found is None:
            found = made._cache.load_overload(signature, made.targetctx)
            new = found is None
            if new:
                found = made._compiler.compile(own, None)
            # Numba finds a function by its entry, which a part does not have.
            found = found._replace(entry_point=_Entry())
            made.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
            made.overloads[own] = found
            if new:
                made._cache.save_overload(signature, found)
        return found.entry_point


class _Entry:
    """In place of a function."""


def _part_template(made: Any, arguments: Any, keywords: Any) -> Any:
    """What typing asks of a part: the same for a constant as for any value of its type."""
    return type(made).get_call_template(made, tuple(_general(each, False) for each in arguments), keywords)


def compile_entry(made: Any, compile_now: Callable[[Any], Any], signature: Any) -> Any:
    """Compile what Python calls: the same for arrays that cannot be written as for those that can.

    The machine code gets the environments of the parts in it, as Numba does on reading it.
    """
    asked = tuple(normalize_signature(signature)[0])
    own = tuple(_general(each, True) for each in asked)
    new = own not in made.overloads
    entry = compile_now(own)
    if new:
        result = made.overloads[own]
        for environment in result._find_referenced_environments() if result.metadata is not None else ():
            result.codegen.set_env(environment.env_name, environment)
    if own != asked:
        made._insert([each._code for each in asked], entry, False)
    return entry


def _general(kind: Any, writeable: bool) -> Any:
    """A type without constants and, if ``writeable``, with arrays that can be written; tuples part by part."""
    if isinstance(kind, types.BaseTuple):
        return types.BaseTuple.from_types(
            [_general(each, writeable) for each in kind], getattr(kind, "instance_class", None)
        )
    if writeable and isinstance(kind, types.Array) and not kind.mutable:
        return kind.copy(readonly=False)
    return types.unliteral(kind)
