// expect:
skillset empty {
}
