// expect: SW098 SW098 SW098
include "types.rl"
include {
    "arm.rl"
    "hand.rl"
}
skillset first {
}
