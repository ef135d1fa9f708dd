#pragma once

#include "sysid/hypotheses/data_hypothesis.h"

namespace sysid {

void SignHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void OrderHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void AbsoluteHypotheses(const CheckInput& input,
                        std::vector<DataHypothesis>* all);
void UnitHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void QuaternionOrders(const CheckInput& input,
                      std::vector<DataHypothesis>* all);
void BodyHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void DelayHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void DriftHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void ClockHypotheses(const CheckInput& input, std::vector<DataHypothesis>* all);
void EffortHypotheses(const CheckInput& input,
                      std::vector<DataHypothesis>* all);

// Hinges and slides whose position any run measures, and those whose effort any
// run has; by index.
std::vector<int> MeasuredJoints(const CheckInput& input);
std::vector<int> DrivenJoints(const CheckInput& input);

// The columns of a hinge's or slide's motion.
std::vector<std::string> MotionColumns(const std::string& joint);

// Columns that are each a factor times what was read.
std::vector<CorrectedColumn> Scaled(const std::vector<std::string>& columns,
                                    double factor);

// The words of a discrete hypothesis.
std::function<std::string(double, double)> Words(const std::string& text);

}  // namespace sysid
