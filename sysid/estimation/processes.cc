#include "sysid/estimation/processes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace sysid {
namespace {

// a + b = sum + error, exactly.
double SumOf(double a, double b, double* error) {
  const double sum = a + b;
  const double of_b = sum - a;
  *error = (a - (sum - of_b)) + (b - of_b);
  return sum;
}

class AloneProcess final : public Processes {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  void Sum(std::vector<LongSum>*) const override {}
  void Max(std::vector<double>*) const override {}
  std::vector<std::string> Gather(const std::string& own) const override {
    return {own};
  }
  std::string Share(const std::string& own) const override { return own; }
};

}  // namespace

void LongSum::operator+=(double x) {
  double error;
  const double sum = SumOf(high, x, &error);
  if (!std::isfinite(sum)) {
    high = sum;
    low = 0.0;
    return;
  }
  high = SumOf(sum, low + error, &low);
}

void LongSum::operator+=(const LongSum& other) {
  double error, low_error;
  const double sum = SumOf(high, other.high, &error);
  if (!std::isfinite(sum)) {
    high = sum;
    low = 0.0;
    return;
  }
  const double lows = SumOf(low, other.low, &low_error);
  high = SumOf(sum, error + lows, &low);
  high = SumOf(high, low + low_error, &low);
}

const Processes& Alone() {
  static const AloneProcess& alone = *new AloneProcess;
  return alone;
}

void Totals::Add(int first, const Eigen::Ref<const Eigen::MatrixXd>& x) {
  for (int c = 0; c < x.cols(); ++c) {
    for (int r = 0; r < x.rows(); ++r) sums_[first++] += x(r, c);
  }
}

Eigen::VectorXd Totals::Over(const Processes& all) {
  all.Sum(&sums_);
  Eigen::VectorXd values(sums_.size());
  for (size_t i = 0; i < sums_.size(); ++i) values[i] = sums_[i].Value();
  return values;
}

double SumOver(const Processes& all, double mine) {
  Totals total(1);
  total.Add(0, mine);
  return total.Over(all)[0];
}

double MaxOver(const Processes& all, double mine) {
  std::vector<double> most = {mine};
  all.Max(&most);
  return most[0];
}

bool AllTrue(const Processes& all, bool mine) {
  return MaxOver(all, mine ? 0.0 : 1.0) == 0.0;
}

Eigen::VectorXd OfFirst(const Processes& all, const Eigen::VectorXd& mine) {
  Totals total(static_cast<int>(mine.size()));
  if (all.rank() == 0) total.Add(0, mine);
  return total.Over(all);
}

std::vector<std::string> GatherToAll(const Processes& all,
                                     const std::string& own) {
  if (all.size() == 1) return {own};
  Packer packer;
  for (const std::string& text : all.Gather(own)) packer.Put(text);
  const std::string bytes = all.Share(packer.bytes());
  std::vector<std::string> texts;
  for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
    texts.push_back(unpacker.Text());
  }
  return texts;
}

// By halving the range of the bits of doubles, which of positive ones rise with
// them.
double MedianOver(const Processes& all, std::vector<double> mine) {
  const double count = SumOver(all, static_cast<double>(mine.size()));
  if (count == 0.0) return 0.0;
  std::sort(mine.begin(), mine.end());
  const double before = std::floor(count / 2.0);  // that are no larger
  uint64_t low = 0;
  uint64_t high =
      std::bit_cast<uint64_t>(MaxOver(all, mine.empty() ? 0.0 : mine.back()));
  while (low < high) {
    const uint64_t middle = low + (high - low) / 2;
    const double value = std::bit_cast<double>(middle);
    const auto end = std::upper_bound(mine.begin(), mine.end(), value);
    const double up_to = SumOver(all, static_cast<double>(end - mine.begin()));
    if (up_to > before) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return std::bit_cast<double>(low);
}

void Packer::Put(double number) {
  bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void Packer::Put(const std::string& text) {
  Put(static_cast<double>(text.size()));
  bytes_ += text;
}

void Packer::Put(const RowMatrixXd& matrix) {
  Put(static_cast<double>(matrix.rows()));
  Put(static_cast<double>(matrix.cols()));
  bytes_.append(reinterpret_cast<const char*>(matrix.data()),
                matrix.size() * sizeof(double));
}

bool Unpacker::Take(void* to, size_t size) {
  if (failed_ || bytes_.size() - at_ < size) {
    failed_ = true;
    return false;
  }
  if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
  at_ += size;
  return true;
}

double Unpacker::Number() {
  double number = 0.0;
  return Take(&number, sizeof number) ? number : 0.0;
}

std::string Unpacker::Text() {
  const double size = Number();
  if (!(size >= 0.0 && size <= static_cast<double>(bytes_.size() - at_))) {
    failed_ = true;
    return "";
  }
  std::string text(static_cast<size_t>(size), '\0');
  Take(text.data(), text.size());
  return text;
}

RowMatrixXd Unpacker::Matrix() {
  const double rows = Number(), cols = Number();
  const double left = static_cast<double>(bytes_.size() - at_);
  if (!(rows >= 0.0 && cols >= 0.0 && rows * cols * sizeof(double) <= left)) {
    failed_ = true;
    return {};
  }
  RowMatrixXd matrix(static_cast<int>(rows), static_cast<int>(cols));
  Take(matrix.data(), matrix.size() * sizeof(double));
  return matrix;
}

}  // namespace sysid
