// expect: SW025 SW025 SW004
type Float
skillset periods {
    data x: Float period 0 ms
    data y: Float period -1.5
    data z: Float period 1e309 sec
}
