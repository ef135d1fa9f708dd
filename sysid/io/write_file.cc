#include "sysid/io/write_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "models/error.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void ThrowSystem(const std::string& path, const std::string& what,
                              int error, const std::string& hint = "") {
  throw InputError(path, what + ": " + std::strerror(error), hint);
}

std::string FolderOf(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

std::string FolderHint(const std::string& path, int error) {
  if (error == ENOENT) return "make the folder '" + FolderOf(path) + "' first";
  if (error == ENOTDIR) return "a part of the path is a file, not a folder";
  return "";
}

// A name beside `path` that nobody else uses: other threads, other programs.
std::string NameBeside(const std::string& path) {
  static std::atomic<int> count{0};
  return path + ".part-" + std::to_string(getpid()) + "-" +
         std::to_string(count++);
}

// Writes all of it; 0 or the error's number.
int WriteAll(int fd, const std::string& text) {
  for (size_t at = 0; at < text.size();) {
    const ssize_t wrote = write(fd, text.data() + at, text.size() - at);
    if (wrote < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    at += static_cast<size_t>(wrote);
  }
  return 0;
}

int WriteDirectly(const std::string& path, const std::string& text) {
  const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) return errno;
  const int error = WriteAll(fd, text);
  const int close_error = close(fd) == 0 ? 0 : errno;
  return error != 0 ? error : close_error;
}

// Writes a new file and proves that it reached the disk.
int WriteNew(const std::string& path, const std::string& text) {
  const int fd =
      open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return errno;
  int error = WriteAll(fd, text);
  if (error == 0 && fsync(fd) != 0 && errno != EINVAL) error = errno;
  if (close(fd) != 0 && error == 0) error = errno;
  return error;
}

// What `path` leads to. A link that leads nowhere is replaced.
std::string FollowLinks(const std::string& path) {
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  return error ? path : real.string();
}

bool IsFolder(const std::string& path) {
  struct stat status;
  return stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

// A device, a pipe: what must not be replaced by a file.
bool IsSpecial(const std::string& path) {
  struct stat status;
  return stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
         !S_ISDIR(status.st_mode);
}

}  // namespace

void WriteFileAtomically(const std::string& path, const std::string& text) {
  const std::string kWhat = "cannot be written";
  if (path.empty()) throw InputError("", "a file without a name");
  if (IsFolder(path)) ThrowSystem(path, kWhat, EISDIR, "name a file in it");
  if (IsSpecial(path)) {
    if (const int error = WriteDirectly(path, text); error != 0) {
      ThrowSystem(path, kWhat, error);
    }
    return;
  }
  const std::string target = FollowLinks(path);
  const std::string temporary = NameBeside(target);
  int error = WriteNew(temporary, text);
  if (error == 0 && std::rename(temporary.c_str(), target.c_str()) != 0) {
    error = errno;
  }
  if (error == 0) return;
  unlink(temporary.c_str());
  ThrowSystem(path, kWhat, error, FolderHint(path, error));
}

void CheckWritableFolder(const std::string& folder, const std::string& flag) {
  if (folder.empty()) throw InputError(flag, "a folder without a name");
  const auto refuse = [&](const std::string& what, int error,
                          const std::string& hint) {
    if (flag.empty()) ThrowSystem(folder, what, error, hint);
    ThrowSystem(flag, "'" + folder + "': " + what, error,
                hint.empty() ? "choose a folder that you may write to" : hint);
  };
  std::error_code code;
  fs::create_directories(folder, code);
  if (code || !IsFolder(folder)) {
    const int error = code ? code.value() : ENOTDIR;
    refuse("the folder cannot be made", error, FolderHint(folder, error));
  }
  const std::string probe =
      NameBeside((fs::path(folder) / "sysid-probe").string());
  const int error = WriteNew(probe, "probe\n");
  unlink(probe.c_str());
  if (error != 0) {
    refuse("files cannot be written into the folder", error,
           "choose a folder that you may write to");
  }
}

void CheckWritableFile(const std::string& path) {
  const std::string kWhat = "cannot be written";
  if (path.empty()) throw InputError("", "a file without a name");
  if (IsFolder(path)) ThrowSystem(path, kWhat, EISDIR, "name a file in it");
  if (IsSpecial(path)) {
    if (access(path.c_str(), W_OK) != 0) ThrowSystem(path, kWhat, errno);
    return;
  }
  const std::string probe = NameBeside(FollowLinks(path));
  const int error = WriteNew(probe, "probe\n");
  unlink(probe.c_str());
  if (error != 0) ThrowSystem(path, kWhat, error, FolderHint(path, error));
}

}  // namespace sysid
