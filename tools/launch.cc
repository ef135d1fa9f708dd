// Stands in bin/ as each program of a package for x86-64 and runs the build of
// it beside it, NAME.x86-64-v3, for the newest instructions that the processor
// has (scripts/package).

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>

namespace {

const char* Level() {
  if (__builtin_cpu_supports("x86-64-v4")) return ".x86-64-v4";
  if (__builtin_cpu_supports("x86-64-v3")) return ".x86-64-v3";
  return ".x86-64";
}

}  // namespace

int main(int, char** argv) {
  std::error_code error;
  std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe", error);
  program += Level();
  execv(program.c_str(), argv);
  std::cerr << program << ": " << std::strerror(errno) << '\n';
  return 1;
}
