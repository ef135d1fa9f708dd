#include <iostream>

#include "models/mechanism.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const sysid::Mechanism mechanism;
  std::cout << argv[1] << ": " << mechanism.nq << '\n';
  return 0;
}
