// expect: SW006
skillset first {
}
skillset second {
}
