# SPDX-License-Identifier: Apache-2.0
# Refuses a compiler without C++20 before it prints hundreds of errors.
include(CheckCXXSourceCompiles)
set(CMAKE_REQUIRED_FLAGS "${CMAKE_CXX20_STANDARD_COMPILE_OPTION}")
check_cxx_source_compiles("
#include <bit>
#include <concepts>
#include <coroutine>
#include <cstddef>
#include <span>
template <std::integral T> consteval T twice(T value) { return 2 * value; }
struct Pair { int one = 1; bool operator==(const Pair&) const = default; };
struct Place {};
struct Dialog : Place {};
struct Task {  // g++ 11 does not find the allocation function of such a coroutine
  struct promise_type {
    template <class... Parameters>
    static void* operator new(std::size_t, Place&, const Parameters&...) noexcept { return nullptr; }
    static void operator delete(void*, std::size_t) {}
    static Task get_return_object_on_allocation_failure() { return {}; }
    Task get_return_object() { return {}; }
    std::suspend_never initial_suspend() noexcept { return {}; }
    std::suspend_never final_suspend() noexcept { return {}; }
    void return_void() {}
    void unhandled_exception() {}
  };
};
Task wait(Dialog&, int) { co_return; }
int main() {
  const int values[] = {twice(std::bit_cast<int>(1.0f))};
  return std::span(values).size() == 1 && Pair{.one = 1} == Pair{} && std::coroutine_handle<>{} == nullptr ? 0 : 1;
}" ABSENC_HAS_CXX20)
unset(CMAKE_REQUIRED_FLAGS)
if(NOT ABSENC_HAS_CXX20)
  message(FATAL_ERROR "absenc needs a compiler for C++20 (g++ 12, clang 14 or newer), which ${CMAKE_CXX_COMPILER} is not.")
endif()

# Sets `result` to arguments of the linker for libraries that are given by name. With ABSENC_STATIC the arguments select
# the static libraries (-l:libNAME.a).
function(absenc_linked result)
  set(names ${ARGN})
  if(ABSENC_STATIC)
    list(TRANSFORM names REPLACE "^(.+)$" "-l:lib\\1.a")
  endif()
  set(${result} ${names} PARENT_SCOPE)
endfunction()

# Sets `result` to the names by which the linker finds these libraries, which CMake has as paths.
function(absenc_plain_names result)
  set(names)
  foreach(library IN LISTS ARGN)
    if(TARGET "${library}")
      get_target_property(library "${library}" IMPORTED_LOCATION)
    endif()
    if(IS_ABSOLUTE "${library}")
      file(REAL_PATH "${library}" library)
      cmake_path(GET library PARENT_PATH folder)
      cmake_path(GET library STEM name)
      string(REGEX REPLACE "^lib" "" name "${name}")
      if(NOT folder IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
        set(name "${library}")
      endif()
      list(APPEND names "${name}")
    else()
      list(APPEND names "${library}")
    endif()
  endforeach()
  set(${result} "${names}" PARENT_SCOPE)
endfunction()
