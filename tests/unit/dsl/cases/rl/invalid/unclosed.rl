// expect: SW001
skillset open {
    resource {
        lamp {
            state { Off On }
            initial Off
            transition all
        }
    skill shine {
        start lamp -> On
        success shone { effect lamp -> Off }
    }
}
