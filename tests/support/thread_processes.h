#pragma once

#include <algorithm>
#include <barrier>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "sysid/estimation/shooting_problem.h"

namespace sysid {

// Threads that stand for processes which share out runs.
class ThreadProcesses {
 public:
  explicit ThreadProcesses(int size)
      : size_(size), meet_(size), sums_(size), maxima_(size), texts_(size) {}

  // Calls work(processes) once for each rank, all at the same time.
  void Run(const std::function<void(const Processes&)>& work) {
    std::vector<std::thread> threads;
    for (int rank = 0; rank < size_; ++rank) {
      threads.emplace_back([&, rank] { work(Member(this, rank)); });
    }
    for (std::thread& thread : threads) thread.join();
  }

 private:
  class Member final : public Processes {
   public:
    Member(ThreadProcesses* group, int rank) : group_(*group), rank_(rank) {}
    int rank() const override { return rank_; }
    int size() const override { return group_.size_; }
    void Sum(std::vector<LongSum>* sums) const override {
      const auto all = Exchange(*sums, &group_.sums_);
      for (size_t i = 0; i < sums->size(); ++i) {
        LongSum total;
        for (const auto& one : all) total += one.at(i);
        (*sums)[i] = total;
      }
    }
    void Max(std::vector<double>* numbers) const override {
      for (const auto& one : Exchange(*numbers, &group_.maxima_)) {
        for (size_t i = 0; i < numbers->size(); ++i) {
          (*numbers)[i] = std::max((*numbers)[i], one.at(i));
        }
      }
    }
    std::vector<std::string> Gather(const std::string& own) const override {
      const auto all = Exchange(own, &group_.texts_);
      return rank_ == 0 ? all : std::vector<std::string>();
    }
    std::string Share(const std::string& own) const override {
      return Exchange(own, &group_.texts_)[0];
    }

   private:
    template <typename T>
    std::vector<T> Exchange(const T& own, std::vector<T>* of_all) const {
      (*of_all)[rank_] = own;
      group_.meet_.arrive_and_wait();
      const std::vector<T> all = *of_all;
      group_.meet_.arrive_and_wait();
      return all;
    }
    ThreadProcesses& group_;
    const int rank_;
  };

  const int size_;
  std::barrier<> meet_;
  std::vector<std::vector<LongSum>> sums_;
  std::vector<std::vector<double>> maxima_;
  std::vector<std::string> texts_;
};

// What a process poses of a problem: options that name all of them, and its
// share of the runs, by their places.
struct SharedPart {
  SharedPart(const Processes& all, const std::vector<Run>& of,
             const std::vector<std::vector<int>>& shares) {
    options.processes =
        std::shared_ptr<const Processes>(std::shared_ptr<void>(), &all);
    for (const int r : shares[all.rank()]) runs.push_back(of[r]);
  }
  EstimationOptions options;
  std::vector<Run> runs;
};

}  // namespace sysid
