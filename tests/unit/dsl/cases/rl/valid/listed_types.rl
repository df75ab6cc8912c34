// expect:
skillset listed<Float, Double> {
    data x: Float
    data y: Double
}
