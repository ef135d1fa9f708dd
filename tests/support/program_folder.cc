#include "tests/support/program_folder.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tests/support/limits.h"

namespace sysid {
namespace {

namespace fs = std::filesystem;

std::string TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "sysid-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error("no temporary folder: " + name);
  }
  return name;
}

std::string ReadAll(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// In the child: nothing but system calls.
void Become(const char* folder, const char* out, const char* err,
            char* const* argv) {
  const int null = open("/dev/null", O_RDONLY);
  const int out_fd = open(out, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int err_fd = open(err, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  LimitWork();
  if (chdir(folder) == 0 && dup2(null, 0) == 0 && dup2(out_fd, 1) == 1 &&
      dup2(err_fd, 2) == 2) {
    execv(argv[0], argv);
  }
  _exit(127);
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * time.tv_usec;
}

// The exit code, -1 where it had to be killed, and the processor time.
void Await(pid_t child, ProgramResult* result) {
  const auto end = std::chrono::steady_clock::now() + kHang;
  int status = 0;
  rusage usage{};
  bool hung = false;
  while (wait4(child, &status, hung ? 0 : WNOHANG, &usage) == 0) {
    if (std::chrono::steady_clock::now() > end) {
      hung = true;
      kill(child, SIGKILL);
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  result->exit_code = hung                ? -1
                      : WIFEXITED(status) ? WEXITSTATUS(status)
                                          : 128 + WTERMSIG(status);
  result->cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
}

}  // namespace

ProgramFolder::ProgramFolder()
    : folder_(TemporaryFolder()), outputs_(TemporaryFolder()) {}

ProgramFolder::~ProgramFolder() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  fs::remove_all(outputs_, ignored);
}

std::string ProgramFolder::Path(const std::string& name) const {
  return folder_ + "/" + name;
}

void ProgramFolder::Write(const std::string& name,
                          const std::string& text) const {
  std::ofstream file(Path(name), std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + Path(name));
}

std::string ProgramFolder::Read(const std::string& name) const {
  if (!Has(name)) throw std::runtime_error("there is no " + Path(name));
  return ReadAll(Path(name));
}

bool ProgramFolder::Has(const std::string& name) const {
  return fs::exists(Path(name));
}

std::map<std::string, std::string> ProgramFolder::Contents() const {
  std::map<std::string, std::string> contents;
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(folder_)) {
    const std::string name = fs::relative(entry.path(), folder_).string();
    if (entry.is_directory()) {
      contents[name + "/"] = "";
    } else {
      contents[name] = ReadAll(entry.path());
    }
  }
  return contents;
}

ProgramResult ProgramFolder::Run(const std::string& program,
                                 const std::vector<std::string>& arguments,
                                 const std::string& stdout_file) const {
  const std::string out = stdout_file.empty() ? outputs_ + "/out" : stdout_file;
  const std::string err = outputs_ + "/err";
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) {
    Become(folder_.c_str(), out.c_str(), err.c_str(), argv.data());
  }
  ProgramResult result;
  Await(child, &result);
  if (stdout_file.empty()) result.out = ReadAll(out);
  result.err = ReadAll(err);
  return result;
}

}  // namespace sysid
