// expect: SW092 SW092 SW092
include "types.rl"
include {
    "arm.rl"
    "hand.rl"
}
skillset first {
}
