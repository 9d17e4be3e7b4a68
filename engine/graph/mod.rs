//! graph
#[derive(Clone, Copy, Debug)]
pub struct Image;
#[derive(Clone, Copy, Debug)]
pub struct Buffer;
#[derive(Clone, Copy, Debug)]
pub struct UniformSlice;
#[derive(Debug)]
pub struct Uniform<T>(std::marker::PhantomData<T>);
impl<T> Clone for Uniform<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Uniform<T> {}
impl<T> From<Uniform<T>> for UniformSlice {
    fn from(_: Uniform<T>) -> Self {
        UniformSlice
    }
}
