// expect: SW016 SW090 SW016 SW016 SW043 SW017
type Float
type Float
type Image
type Image
skillset twice {
    data image: Image
    data level: Float
    resource lamp {
        state { Off On Off }
        initial Off
        transition all
    }
    skill shine {
        start {
            lamp -> On
            lamp -> Off
        }
        interrupt { interrupting false effect lamp -> Off }
        interrupt { interrupting true effect lamp -> Off }
        success shone { effect lamp -> Off }
    }
}
