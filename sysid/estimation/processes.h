#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "models/math/types.h"

namespace sysid {

// A sum of numbers as two doubles, about 106 bits: rounded to one it is the
// same in whatever order the numbers came (Knuth 1969; Dekker 1971).
class LongSum {
 public:
  void operator+=(double x);
  void operator+=(const LongSum& other);
  double Value() const { return high + low; }

  double high = 0.0, low = 0.0;
};

// Processes that share out the runs of a data set, each with some that follow
// each other (by rank, all of them in the order of the user's list). Every
// process runs the same program with its own runs; where a number is about all
// runs, all meet in one of these calls. So they must be made by the main
// thread, and by all processes alike: whatever decides what is done next has
// come out of such a call.
class Processes {
 public:
  virtual ~Processes() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  // Replaces each by its sum over all processes.
  virtual void Sum(std::vector<LongSum>* sums) const = 0;
  // Replaces each by the largest of all processes.
  virtual void Max(std::vector<double>* numbers) const = 0;
  // What each process says, by rank: to the first one. Nothing for the others.
  virtual std::vector<std::string> Gather(const std::string& own) const = 0;
  // What the first one says.
  virtual std::string Share(const std::string& own) const = 0;
  // Asked to stop where any process's `mine` was: by all at the same point of
  // their work, a call of the above.
  virtual std::stop_token StopTogether(const std::stop_token& mine) const {
    return mine;
  }
};

// One process with all runs.
const Processes& Alone();

// Sums over the runs of all processes, the same to the bit however these share
// them out.
class Totals {
 public:
  explicit Totals(int size) : sums_(size) {}
  void Add(int i, double x) { sums_[i] += x; }
  // From place `first` on, column by column.
  void Add(int first, const Eigen::Ref<const Eigen::MatrixXd>& x);
  // Only once, when all is added.
  Eigen::VectorXd Over(const Processes& all);

 private:
  std::vector<LongSum> sums_;
};

double SumOver(const Processes& all, double mine);
double MaxOver(const Processes& all, double mine);
bool AllTrue(const Processes& all, bool mine);
// Of the first process, to rule out that machines round differently.
Eigen::VectorXd OfFirst(const Processes& all, const Eigen::VectorXd& mine);
// What each process says, by rank: to all.
std::vector<std::string> GatherToAll(const Processes& all,
                                     const std::string& own);
// The number in the middle of the positive ones of all processes: of an even
// count the upper one. 0 where there are none.
double MedianOver(const Processes& all, std::vector<double> mine);

// Numbers and texts in a row, for Gather.
class Packer {
 public:
  void Put(double number);
  void Put(const std::string& text);
  void Put(const RowMatrixXd& matrix);
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};
class Unpacker {
 public:
  explicit Unpacker(const std::string& bytes) : bytes_(bytes) {}
  double Number();
  int Count() { return static_cast<int>(Number()); }
  std::string Text();
  RowMatrixXd Matrix();
  bool AtEnd() const { return at_ == bytes_.size(); }
  // Whether more was asked for than there is.
  bool failed() const { return failed_; }

 private:
  bool Take(void* to, size_t size);

  const std::string& bytes_;
  size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace sysid
