#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sysid/diagnosis/diagnose.h"

namespace sysid {

// Adds names that are not yet known.
void AddNames(const std::vector<std::string>& names,
              std::vector<std::string>* known);

// What the steps say could stand in the place of an effect that was added.
std::vector<std::string> AlternativesTo(
    const std::string& effect, const std::vector<DiagnosisStep>& steps);

// Notes in the steps, of an effect that was added, what else could stand in its
// place.
void AddAlternatives(const std::string& effect,
                     const std::vector<std::string>& alternatives,
                     std::vector<DiagnosisStep>* steps);

// Takes out of them what a better model tells apart.
void RemoveAlternatives(const std::string& effect,
                        const std::vector<std::string>& told_apart,
                        std::vector<DiagnosisStep>* steps);

// Fills in `rivals`: what could stand in the place of each effect of the
// answer, but no law that needs more parameters, which would be an extension
// and no rival. With rivals a missing effect is undecided.
void FindRivals(const std::vector<std::shared_ptr<const Effect>>& candidates,
                Diagnosis* diagnosis);

}  // namespace sysid
