#include "sysid/io/write_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string_view>
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
  if (error == ENOSPC || error == EDQUOT) {
    return "the disk is full: make room, or write to another";
  }
  if (error == EFBIG) return "raise the limit of file sizes (ulimit -f)";
  if (error == EROFS || error == EACCES || error == EPERM) {
    return "choose a folder that you may write to";
  }
  return "";
}

constexpr std::string_view kMark = ".sysid-part-";

// A name beside `path` that nobody else uses: other threads, other programs.
std::string NameBeside(const std::string& path) {
  static std::atomic<int> count{0};
  return path + std::string(kMark) + std::to_string(getpid()) + "-" +
         std::to_string(count++);
}

bool IsTemporaryName(const std::string& name) {
  const size_t mark = name.rfind(kMark);
  return mark != std::string::npos && mark > 0 &&
         name.find_first_not_of("0123456789-", mark + kMark.size()) ==
             std::string::npos;
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

// The text on the disk; the file stays open, and locked: its writer lives.
int Fill(int fd, const std::string& text) {
  flock(fd, LOCK_EX | LOCK_NB);
  const int error = WriteAll(fd, text);
  return error == 0 && fsync(fd) != 0 && errno != EINVAL ? errno : error;
}

// Gives an open file without a name its first one; it must not be there.
int Name(int fd, const std::string& path) {
  // By /proc: linkat of the descriptor itself needs a privilege.
  const std::string open_file = "/proc/self/fd/" + std::to_string(fd);
  return linkat(AT_FDCWD, open_file.c_str(), AT_FDCWD, path.c_str(),
                AT_SYMLINK_FOLLOW) == 0
             ? 0
             : errno;
}

// Writes the text under `target`, replacing a file that is there; 0 or the
// error's number.
int WriteWhole(const std::string& target, const std::string& text) {
  const std::string temporary = NameBeside(target);
  int fd =
      open(FolderOf(target).c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666);
  const bool unnamed = fd >= 0;
  if (!unnamed) {
    fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0) return errno;
  }
  int error = Fill(fd, text);
  bool named = !unnamed;
  if (error == 0 && unnamed) {
    error = Name(fd, target);
    if (error == 0) return close(fd) == 0 ? 0 : errno;
    if (error == EEXIST) error = Name(fd, temporary);
    named = error == 0;
  }
  if (error == 0 && std::rename(temporary.c_str(), target.c_str()) != 0) {
    error = errno;
  }
  if (error != 0 && named) unlink(temporary.c_str());
  close(fd);
  return error;
}

// Whether a new file of some length could be written beside `path`.
int Probe(const std::string& path) {
  const std::string probe = NameBeside(path);
  const int fd =
      open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return errno;
  const int error = Fill(fd, "probe\n");
  unlink(probe.c_str());
  close(fd);
  return error;
}

// Removes what killed writers left in a folder. Never throws: it is a courtesy.
void RemoveAbandoned(const std::string& folder) {
  // That of another program, between making its file and locking it, is
  // younger.
  constexpr auto kYoung = std::chrono::seconds(2);
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end;
       at.increment(code)) {
    const std::string name = at->path().filename().string();
    std::error_code gone;
    const auto written = at->last_write_time(gone);
    if (gone || fs::file_time_type::clock::now() - written < kYoung ||
        !IsTemporaryName(name) ||
        at->symlink_status(gone).type() != fs::file_type::regular) {
      continue;
    }
    const int fd = open(at->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0) continue;
    if (flock(fd, LOCK_EX | LOCK_NB) == 0) unlink(at->path().c_str());
    close(fd);
  }
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

constexpr char kUnwritable[] = "cannot be written";

// Whether it is a device or a pipe: what must not be replaced by a file. Throws
// InputError where it is a folder.
bool CheckNoFolder(const std::string& path) {
  if (path.empty()) throw InputError("", "a file without a name");
  if (IsFolder(path)) {
    ThrowSystem(path, kUnwritable, EISDIR, "name a file in it");
  }
  struct stat status;
  return stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode);
}

}  // namespace

void WriteFileAtomically(const std::string& path, const std::string& text) {
  const bool is_special = CheckNoFolder(path);
  const int error = is_special ? WriteDirectly(path, text)
                               : WriteWhole(FollowLinks(path), text);
  if (error != 0) {
    ThrowSystem(path, kUnwritable, error,
                is_special ? "" : FolderHint(path, error));
  }
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
  RemoveAbandoned(folder);
  const int error = Probe((fs::path(folder) / "probe").string());
  if (error != 0) {
    refuse("files cannot be written into the folder", error,
           error == ENOSPC || error == EDQUOT
               ? FolderHint(folder, error)
               : "choose a folder that you may write to");
  }
}

void CheckWritableFile(const std::string& path) {
  if (CheckNoFolder(path)) {
    if (access(path.c_str(), W_OK) != 0) ThrowSystem(path, kUnwritable, errno);
    return;
  }
  const std::string target = FollowLinks(path);
  RemoveAbandoned(FolderOf(target));
  const int error = Probe(target);
  if (error != 0) {
    ThrowSystem(path, kUnwritable, error, FolderHint(path, error));
  }
}

}  // namespace sysid
