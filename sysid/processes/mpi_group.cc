#define OMPI_SKIP_MPICXX 1  // of C++ no more than of C
#include <fcntl.h>
#include <mpi.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "sysid/processes/process_group.h"
#include "sysid/processes/supervised.h"

namespace sysid {
namespace {

// The number that a launcher of MPI gave this process; null where none started
// it.
const char* LaunchedRank() {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"}) {
    if (const char* const rank = std::getenv(name)) return rank;
  }
  return nullptr;
}

void AddLongSums(void* in, void* inout, int* count, MPI_Datatype*) {
  const auto* const more = static_cast<const LongSum*>(in);
  auto* const sums = static_cast<LongSum*>(inout);
  for (int i = 0; i < *count; ++i) sums[i] += more[i];
}

// The threads that MPI starts leave interrupts to the program's.
void Init() {
  sigset_t interrupts, before;
  sigemptyset(&interrupts);
  sigaddset(&interrupts, SIGINT);
  sigaddset(&interrupts, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &interrupts, &before);
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

// Cores that this process may run on.
int OwnCores() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  if (sched_getaffinity(0, sizeof cores, &cores) != 0) return 1;
  return std::max(1, CPU_COUNT(&cores));
}

class MpiGroup final : public ProcessGroup {
 public:
  MpiGroup() {
    Init();
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    MPI_Comm_dup(MPI_COMM_WORLD, &end_);
    MPI_Type_contiguous(2, MPI_DOUBLE, &long_sum_);
    MPI_Type_commit(&long_sum_);
    MPI_Op_create(AddLongSums, 1, &add_);
    MPI_Comm here;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_,
                        MPI_INFO_NULL, &here);
    MPI_Comm_size(here, &on_machine_);
    MPI_Comm_free(&here);
  }

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  int CoresEach() const override {
    const int all = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
    const int own = OwnCores();
    // The launcher may have bound each to its own.
    return own < all ? own : std::max(1, all / on_machine_);
  }

  void Sum(std::vector<LongSum>* sums) const override {
    LongSum stops;
    stops += stop_.stop_requested() ? 1.0 : 0.0;
    sums->push_back(stops);
    const int count = static_cast<int>(sums->size());
    std::vector<LongSum> total(*sums);
    MPI_Reduce(sums->data(), total.data(), count, long_sum_, add_, 0,
               MPI_COMM_WORLD);
    MPI_Bcast(total.data(), count, long_sum_, 0, MPI_COMM_WORLD);
    *sums = std::move(total);
    if (sums->back().Value() > 0.0) together_.request_stop();
    sums->pop_back();
  }
  void Max(std::vector<double>* numbers) const override {
    numbers->push_back(stop_.stop_requested() ? 1.0 : 0.0);
    const int count = static_cast<int>(numbers->size());
    std::vector<double> most(*numbers);
    MPI_Reduce(numbers->data(), most.data(), count, MPI_DOUBLE, MPI_MAX, 0,
               MPI_COMM_WORLD);
    MPI_Bcast(most.data(), count, MPI_DOUBLE, 0, MPI_COMM_WORLD);
    *numbers = std::move(most);
    if (numbers->back() > 0.0) together_.request_stop();
    numbers->pop_back();
  }
  std::vector<std::string> Gather(const std::string& own) const override {
    if (rank_ > 0) {
      SendText(own);
      return {};
    }
    std::vector<std::string> texts = {own};
    for (int from = 1; from < size_; ++from) {
      texts.push_back(ReceiveText(from));
    }
    return texts;
  }
  std::string Share(const std::string& own) const override {
    std::string text = own;
    double size = static_cast<double>(text.size());
    MPI_Bcast(&size, 1, MPI_DOUBLE, 0, MPI_COMM_WORLD);
    text.resize(static_cast<size_t>(size));
    for (size_t at = 0; at < text.size(); at += kPart) {
      MPI_Bcast(text.data() + at, PartAt(text, at), MPI_BYTE, 0,
                MPI_COMM_WORLD);
    }
    return text;
  }

  std::stop_token StopTogether(const std::stop_token& mine) const override {
    stop_ = mine;
    return together_.get_token();
  }
  void Finish() override { finished_ = true; }
  int Run(const std::function<int()>& program) override;

 private:
  static constexpr size_t kPart = size_t{1} << 30;  // bytes of a message
  static int PartAt(const std::string& text, size_t at) {
    return static_cast<int>(std::min(kPart, text.size() - at));
  }
  void SendText(const std::string& text) const {
    const double size = static_cast<double>(text.size());
    MPI_Send(&size, 1, MPI_DOUBLE, 0, 0, MPI_COMM_WORLD);
    for (size_t at = 0; at < text.size(); at += kPart) {
      MPI_Send(text.data() + at, PartAt(text, at), MPI_BYTE, 0, 0,
               MPI_COMM_WORLD);
    }
  }
  std::string ReceiveText(int from) const {
    double size = 0.0;
    MPI_Recv(&size, 1, MPI_DOUBLE, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    std::string text(static_cast<size_t>(size), '\0');
    for (size_t at = 0; at < text.size(); at += kPart) {
      MPI_Recv(text.data() + at, PartAt(text, at), MPI_BYTE, from, 0,
               MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    }
    return text;
  }
  bool AllEnd() const;

  int rank_ = 0, size_ = 1, on_machine_ = 1;
  MPI_Comm end_ = MPI_COMM_NULL;
  MPI_Datatype long_sum_ = MPI_DATATYPE_NULL;
  MPI_Op add_ = MPI_OP_NULL;
  bool finished_ = false;
  mutable std::stop_token stop_;
  mutable std::stop_source together_;
};

// False where the others are still at work some seconds after this one failed.
bool MpiGroup::AllEnd() const {
  constexpr double kPatience = 5.0, kPause = 0.01;  // s
  MPI_Request request;
  MPI_Ibarrier(end_, &request);
  for (double waited = 0.0;; waited += kPause) {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return true;
    if (!finished_ && waited > kPatience) return false;
    std::this_thread::sleep_for(std::chrono::duration<double>(kPause));
  }
}

int MpiGroup::Run(const std::function<int()>& program) {
  int errors = -1, kept = -1;  // of this process where it is not heard
  if (rank_ > 0) {
    std::fflush(stdout);
    std::fflush(stderr);
    errors = dup(STDERR_FILENO);
    kept = memfd_create("errors", MFD_CLOEXEC);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDOUT_FILENO);
    dup2(kept >= 0 ? kept : nowhere, STDERR_FILENO);
    close(nowhere);
  }
  const int code = program();
  std::fflush(stderr);
  if (AllEnd()) {
    MPI_Finalize();
    return code;
  }
  if (rank_ > 0 && kept >= 0) {
    std::string text(static_cast<size_t>(lseek(kept, 0, SEEK_END)), '\0');
    const ssize_t size = pread(kept, text.data(), text.size(), 0);
    text.resize(static_cast<size_t>(std::max<ssize_t>(0, size)));
    dprintf(errors, "process %d of %d: %s", rank_, size_, text.c_str());
  }
  MPI_Abort(MPI_COMM_WORLD, code == 0 ? 1 : code);
  return code;
}

}  // namespace

std::shared_ptr<ProcessGroup> ProcessGroup::Join() {
  const char* const rank = LaunchedRank();
  if (rank == nullptr) return nullptr;
  ContinueSupervised(std::string("process ") + rank);
  return std::make_shared<MpiGroup>();
}

}  // namespace sysid
